"""One gear: profile, fillet, flank deviations, cracks, and what may be."""
