"""From records to spectra of force and transmission error."""
