"""Cases of a challenge: plan, nominal rig, folders of records."""
