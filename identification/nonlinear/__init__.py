"""What the response holds besides the linear one: noise, even and odd distortion, operating response."""
