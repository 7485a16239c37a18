"""Files of measuring programs, one format a file: each importer hands back the same value, a `Source`."""
