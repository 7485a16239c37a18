"""What a record says of its rig, and what sensors make of motions."""
