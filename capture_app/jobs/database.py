"""The database of the jobs (SQLite, or PostgreSQL where an address is given), and its tables."""

import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from dbos import DBOS
from sqlalchemy import event, exc
from sqlalchemy.schema import CreateIndex, CreateTable

from omomo_core.errors import InputError

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


_DRIVERS = {
    "sqlite": "sqlite",
    "postgresql": "postgresql+psycopg",
    "postgres": "postgresql+psycopg",
}
_LOCK = 0x6F6D6F63
"""Number of the advisory lock under which PostgreSQL's tables are made."""


class Database:
    """An open database whose faults are told in words."""

    def __init__(self, url: str, *, patience: float = 30.0) -> None:
        """Open it, and make the tables that are missing.

        Args:
            url: "sqlite:///jobs.sqlite", a path of a SQLite file, or "postgresql://...".
            patience: seconds to wait for a database that others have locked.

        Raises:
            InputError: "jobs-database-..."
        """
        self._url = _parsed(url)
        self.engine = _engine(self._url, patience)
        with self._told():
            self._check_whole()
            if not sa.inspect(self.engine).has_table(JOBS.name):
                DBOS.migrate(self.url)
                self._make_tables()

    @property
    def url(self) -> str:
        """The address with its password, which is not for people."""
        return self._url.render_as_string(hide_password=False)

    @property
    def shown(self) -> str:
        """Without its password."""
        return self._url.render_as_string(hide_password=True)

    @property
    def file(self) -> Path | None:
        """The file of SQLite."""
        return Path(self._url.database or "") if self.engine.dialect.name == "sqlite" else None

    @property
    def now(self) -> sa.ColumnElement[float]:
        """Seconds since 1970: of one clock, however many machines look at it."""
        if self.file is not None:
            return sa.literal(time.time())
        return sa.cast(sa.extract("epoch", sa.func.clock_timestamp()), sa.Float)

    @contextmanager
    def begin(self) -> Generator[sa.Connection]:
        """A transaction.

        Raises:
            InputError: "jobs-database-..."
        """
        with self._told(), self.engine.begin() as connection:
            yield connection

    def close(self) -> None:
        """Let go of the connections."""
        self.engine.dispose()

    def _check_whole(self) -> None:
        with self.engine.connect() as connection:
            if self.file is None:
                connection.execute(sa.text("SELECT 1"))
            elif (found := connection.execute(sa.text("PRAGMA quick_check(1)")).scalar()) != "ok":
                raise self._damaged(str(found))

    def _make_tables(self) -> None:
        with self.engine.begin() as connection:
            if self.file is None:
                connection.execute(sa.text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
            for table in METADATA.sorted_tables:
                connection.execute(CreateTable(table, if_not_exists=True))
                for index in table.indexes:
                    connection.execute(CreateIndex(index, if_not_exists=True))

    @contextmanager
    def _told(self) -> Generator[None]:
        try:
            yield
        except exc.IntegrityError:
            raise
        except exc.DatabaseError as error:
            raise self._explained(str(error.orig)) from error

    def _explained(self, why: str) -> InputError:
        first = why.strip().splitlines()[0] if why.strip() else "no reason given"
        if self.file is None:
            return InputError(
                "jobs-database-unreachable",
                f"The database of the jobs does not answer: {first}.",
                where=self.shown,
                fix="Check that it runs, that it can be reached from here, and the user, password "
                "and name of the database in its URL.",
            )
        if "locked" in why:
            return InputError(
                "jobs-database-locked",
                "Another program keeps the database of the jobs locked.",
                where=str(self.file),
                fix="Close that program. Keep the file on a disk of this machine: network disks "
                "lock badly.",
            )
        if "disk is full" in why:
            return InputError(
                "disk-full",
                "The disk is full that the database of the jobs is on.",
                where=str(self.file),
                fix="Make room on it, and begin again: what is done stays.",
            )
        if any(word in why for word in ("malformed", "not a database", "disk I/O", "corrupt")):
            return self._damaged(first)
        return InputError(
            "jobs-database-unusable",
            f"The database of the jobs cannot be used: {first}.",
            where=str(self.file),
            fix="Check that its folder is there, that you may write to it and that the disk has "
            "room.",
        )

    def _damaged(self, why: str) -> InputError:
        return InputError(
            "jobs-database-damaged",
            f"The database of the jobs is damaged: {why}.",
            where=str(self.file),
            fix="Move the file away and start again: an empty one is made. Finished results are "
            "whole; only the list of jobs is lost, and ‹omocap batch› finds again what it has done.",
        )


def _parsed(url: str) -> sa.URL:
    try:
        parsed = sa.make_url(url if "://" in url else f"sqlite:///{url}")
        driver = _DRIVERS[parsed.get_backend_name()]
    except (exc.ArgumentError, KeyError, ValueError):
        raise InputError(
            "jobs-database-url",
            "This is no database that jobs can be kept in.",
            field="database",
            fix="Give postgresql://user@host/name, or the path of a SQLite file.",
        ) from None
    return parsed.set(drivername=driver)


def _engine(url: sa.URL, patience: float) -> sa.Engine:
    if url.get_backend_name() != "sqlite":
        return sa.create_engine(
            url, pool_pre_ping=True, connect_args={"connect_timeout": max(2, round(patience))}
        )
    engine = sa.create_engine(url, connect_args={"timeout": patience})
    event.listen(engine, "connect", _set_up_sqlite)
    return engine


def _set_up_sqlite(connection: Any, _record: object) -> None:
    # A transaction that began by reading could not wait for its turn to write.
    connection.isolation_level = "IMMEDIATE"
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA foreign_keys=ON")
