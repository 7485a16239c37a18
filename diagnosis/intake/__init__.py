"""Records become measurements, checked against the nominal rig."""
