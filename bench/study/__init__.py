"""Many members of one case: what varies, what is wanted of each, where they are computed, what came out."""
