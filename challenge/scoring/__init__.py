"""What a diagnosis makes of a challenge, judged against the answers."""
