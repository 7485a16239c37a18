"""Case files: TOML in and out, schema, reference."""
