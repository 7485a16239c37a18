"""Pictures of studies: which key decides, the valley around an optimum."""
