"""Many recordings: plan, measure on all cores or a cluster, resume, and gather the results."""

from tsvision.batch.run import BatchReport, run_batch

__all__ = ["BatchReport", "run_batch"]
