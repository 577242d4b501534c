"""Published experiments, rerun: one file a paper, its tables beside ours."""
