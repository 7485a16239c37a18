"""Which effect that the simulation leaves out causes its gap to the measurement.

`intake`: records become measurements, checked against the nominal rig. `forces`: the force missing from each equation
of motion, and how it depends on the unknowns. `effects`: the library, an effect a file. `evidence`: hypotheses, their
evidence, the search among them. `replay`: rigs simulated under the records' own torque: gap, gap budget. `structure`:
what a rig has that no nominal case gives. `simulation`: simulated lines of all records and their derivatives.
`fitting`: rigs fitted to the records as they are simulated. `selection`: which effects they call for. `remainder`: what
the rig found leaves, and where. `judging`: what was found held against a record that had no part in it, which decides.
`detection`: how small an effect may be for records to show it. `planning`: what planned records would tell, before
anything is measured.
"""

from gearbench.diagnosis.diagnosis import Diagnosis, diagnose
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.verdict import Verdict
from gearbench.diagnosis.verdict_file import read_verdict, verdict_json

__all__ = ["Diagnosis", "DiagnosisError", "Verdict", "diagnose", "read_verdict", "verdict_json"]
