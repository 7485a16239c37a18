"""Pictures of frequency responses: maps, branches, quality, distortion, orders."""
