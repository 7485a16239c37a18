"""Which effects the records call for beside what a fit holds: weighed, simulated, entered one by one."""
