"""The commands of the command line, one a file: about gears, experiments, measured records, and the house itself."""
