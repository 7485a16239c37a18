"""Pictures of records: against time, side by side, over speed."""
