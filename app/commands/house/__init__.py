"""Commands about gearbench itself: its cases, its case format, its validation."""
