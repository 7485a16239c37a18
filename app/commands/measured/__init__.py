"""Commands about records: identify, compare, convert, diagnose, challenge."""
