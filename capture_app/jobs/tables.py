"""The tables of the queue, beside those of DBOS in the same database."""

import sqlalchemy as sa

METADATA = sa.MetaData()

JOBS = sa.Table(
    "omocap_jobs",
    METADATA,
    sa.Column("id", sa.String(16), primary_key=True),
    sa.Column("kind", sa.String, nullable=False),
    sa.Column("name", sa.String, nullable=False),
    sa.Column("order", sa.JSON, nullable=False),
    sa.Column("state", sa.String, nullable=False, default="queued"),
    sa.Column("stage", sa.String, nullable=False, default=""),
    sa.Column("fraction", sa.Float, nullable=False, default=0.0),
    sa.Column("log", sa.JSON, nullable=False, default=list),
    sa.Column("timings", sa.JSON, nullable=False, default=dict),
    sa.Column("inputs", sa.JSON, nullable=False, default=list),
    sa.Column("options", sa.JSON, nullable=False, default=dict),
    sa.Column("output", sa.String),
    sa.Column("summary", sa.JSON, nullable=False, default=dict),
    sa.Column("error", sa.JSON(none_as_null=True)),
    sa.Column("attempts", sa.Integer, nullable=False, default=0),
    # The DBOS workflow that does it; another one each time that it is put into the queue.
    sa.Column("workflow", sa.String, nullable=False),
    # Which worker has it, and how many died while they had it.
    sa.Column("worker", sa.String),
    sa.Column("deaths", sa.Integer, nullable=False, default=0),
    # Seconds since 1970.
    sa.Column("created", sa.Float, nullable=False),
    sa.Column("started", sa.Float),
    sa.Column("ended", sa.Float),
    sa.Index("omocap_jobs_state", "state", "created"),
    sa.Index("omocap_jobs_created", "created"),
    sa.Index("omocap_jobs_worker", "worker"),
)

WORKERS = sa.Table(
    "omocap_workers",
    METADATA,
    sa.Column("id", sa.String, primary_key=True),
    sa.Column("host", sa.String, nullable=False),
    # Seconds since 1970 by the database's clock.
    sa.Column("beat", sa.Float, nullable=False),
)
"""The workers that live."""
