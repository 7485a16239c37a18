"""Pictures, one idea a file: of gears, records, responses, gaps and studies. `of_run`: those that a run draws."""
