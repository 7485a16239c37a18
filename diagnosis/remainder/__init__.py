"""What the rig found leaves: forces that it lacks, by place, forces without a name, and what changes between
repetitions."""
