"""What was found, held against a record that had no part in it: what each effect closes, and the verdict."""
