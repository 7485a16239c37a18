"""Truth rigs: their structure, levels of effects, equations of motion and measurement."""
