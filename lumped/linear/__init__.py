"""The linear periodic model with three degrees of freedom."""
