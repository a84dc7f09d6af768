"""What happened and why: the log of a run, the report of a crash, and the doctor."""
