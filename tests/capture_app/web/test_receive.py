"""However many requests come for one file, the bytes of it stay in their places."""

import asyncio
import random
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from starlette.requests import ClientDisconnect

from capture_app.web import site
from capture_app.web.problems import Refused
from capture_app.web.site import Receiver

DATA = random.Random(5).randbytes(400_000)


async def _body(start: int, stop: int, rng: random.Random) -> AsyncIterator[bytes]:
    """A client that sends piece by piece, dawdles, and may break off."""
    while start < stop:
        await asyncio.sleep(rng.choice([0, 0, 0.001, 0.005]))
        if rng.random() < 0.1:
            raise ClientDisconnect
        end = min(stop, start + rng.randrange(1, 20_000))
        yield DATA[start:end]
        start = end


async def _client(receiver: Receiver, place: Path, rng: random.Random) -> None:
    for _ in range(8):
        await asyncio.sleep(rng.uniform(0, 0.01))
        have = place.stat().st_size if place.exists() else 0
        stop = min(len(DATA), have + 60_000)
        try:
            await receiver.append(place, have, stop - have, _body(have, stop, rng))
        except (Refused, ClientDisconnect):
            continue


@pytest.fixture
def _slow_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Others come while the last bytes are being written."""
    write = site._Tail.write

    def slowly(tail: site._Tail) -> None:
        tail._open()
        time.sleep(0.005)
        write(tail)

    monkeypatch.setattr(site._Tail, "write", slowly)


@pytest.mark.usefixtures("_slow_disk")
@pytest.mark.parametrize("seed", range(4))
def test_many_who_send_the_same_file_at_once(tmp_path: Path, seed: int):
    place = tmp_path / "a.bin"
    rng = random.Random(seed)

    async def crowd() -> None:
        receiver = Receiver()
        clients = (_client(receiver, place, random.Random(rng.random())) for _ in range(12))
        await asyncio.gather(*clients)

    asyncio.run(crowd())
    kept = place.read_bytes()
    assert len(kept) > 10_000
    assert kept == DATA[: len(kept)]


def test_who_is_cut_off_is_told(tmp_path: Path):
    async def hangs() -> AsyncIterator[bytes]:
        yield DATA[:100]
        await asyncio.sleep(60)
        yield b"never"

    async def one_after_the_other() -> tuple[BaseException | int, BaseException | int]:
        receiver, place = Receiver(), tmp_path / "a.bin"
        first = asyncio.ensure_future(receiver.append(place, 0, 200, hangs()))
        await asyncio.sleep(0.05)
        second = receiver.append(place, 100, 0, _body(0, 0, random.Random(0)))
        return tuple(await asyncio.gather(first, second, return_exceptions=True))  # type: ignore[return-value]

    told, have = asyncio.run(one_after_the_other())
    assert isinstance(told, Refused)
    assert told.code == "upload-taken-over"
    assert have == 100
    assert (tmp_path / "a.bin").read_bytes() == DATA[:100]
