"""What a record alone can tell about itself: refused in a sentence, or warned of where it can be right."""

from gearbench.records.checks.door import CHECKS, check_record
from gearbench.records.checks.finding import Finding

__all__ = ["CHECKS", "Finding", "check_record"]
