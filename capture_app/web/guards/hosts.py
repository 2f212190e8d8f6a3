"""Which names the server answers to: a web site that points its own name here is not one of them."""

import re
import socket
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address

from starlette.requests import Request
from starlette.responses import Response

from capture_app.web.problems import refusal

_HOST = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(?::([0-9]{1,5}))?")


@dataclass(frozen=True)
class Hosts:
    """The names and addresses that a Host header may have."""

    names: frozenset[str]
    """In lower case, without a port."""
    any_address: bool = False
    """Any IP address too: nobody can register one as the name of a web site."""

    def allow(self, host: str) -> bool:
        """Whether a name without port is one of ours."""
        name = host.lower().rstrip(".")
        address = _address(name)
        if address is not None:
            return self.any_address or address.is_loopback or name in self.names
        return name == "localhost" or name.endswith(".localhost") or name in self.names

    def guard(self, request: Request) -> Response | None:
        """Refuse a request for another host."""
        given = request.headers.getlist("host")
        found = split_host(given[0]) if len(given) == 1 else None
        if found is not None and self.allow(found[0]):
            return None
        return refusal(
            403,
            "host-unknown",
            "The server does not answer to this name.",
            where=f"Host: {', '.join(given)!r:.100}",
            fix="Use the address that it printed. If a proxy stands before it, start it with "
            "--allow-host NAME.",
        )


def hosts_of(bound: str, allowed: tuple[str, ...]) -> Hosts:
    """The names of a server that is bound to an address, with those that its user allows.

    Args:
        bound: what --host says.
        allowed: what --allow-host says, each a name with or without a port.
    """
    names = {split[0].lower() for name in allowed if (split := split_host(name)) is not None}
    if is_loopback(bound):
        return Hosts(frozenset(names))
    own = socket.gethostname().lower()
    return Hosts(frozenset({*names, bound.lower(), own, f"{own}.local"}), any_address=True)


def split_host(text: str) -> tuple[str, str] | None:
    """Name (an IPv6 address keeps its brackets) and port ("" if none); None for what is neither."""
    match = _HOST.fullmatch(text)
    return (match[1], match[2] or "") if match else None


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach it."""
    address = _address(host)
    return host == "localhost" if address is None else address.is_loopback


def _address(host: str) -> IPv4Address | IPv6Address | None:
    try:
        return ip_address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return None
