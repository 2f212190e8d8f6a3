"""Who asks: another web site that is open in the same browser may not, neither to read nor to write.

Browsers say where a request comes from in Sec-Fetch-Site (only to https and to this machine) and in
Origin (with every request that changes something). Programs that are no browsers say neither.
"""

from collections.abc import Callable

from starlette.requests import Request
from starlette.responses import Response

from capture_app.web.guards.hosts import split_host
from capture_app.web.problems import refusal

_READS = ("GET", "HEAD")
_OWN = ("same-origin", "none")
"""none: its user typed the address, or opened a bookmark."""
_PORTS = {"http": "80", "https": "443"}


def origin_guard(proxied: frozenset[str]) -> Callable[[Request], Response | None]:
    """The guard of a server.

    Args:
        proxied: names under which proxies that may change the Host show the server to browsers.
    """

    def guard(request: Request) -> Response | None:
        site = request.headers.get("sec-fetch-site")
        if site is not None and site not in _OWN and not _followed_link(request):
            return _foreign(f"Sec-Fetch-Site: {site!r:.40}")
        origin = request.headers.get("origin")
        if request.method in _READS or origin is None or _is_ours(request, origin, proxied):
            return None
        return _foreign(f"Origin: {origin!r:.100}")

    return guard


def _followed_link(request: Request) -> bool:
    """Somebody came here by a link: the page opens, and nothing is told to where they were."""
    return (
        request.method in _READS
        and request.headers.get("sec-fetch-mode") == "navigate"
        and request.headers.get("sec-fetch-dest") == "document"
    )


def _is_ours(request: Request, origin: str, proxied: frozenset[str]) -> bool:
    scheme, _, place = origin.partition("://")
    there, here = split_host(place), split_host(request.headers.get("host", ""))
    if there is None or here is None or scheme not in _PORTS:
        return False
    if there[0].lower() in proxied:
        return True
    # A proxy may have taken https off on the way: then the port is the default one of https.
    same_port = (there[1] or _PORTS[scheme]) == (here[1] or _PORTS[scheme])
    return there[0].lower() == here[0].lower() and same_port


def _foreign(where: str) -> Response:
    return refusal(
        403,
        "cross-site",
        "Another web site sent this request.",
        where=where,
        fix="Use the server's own page. If a proxy shows it under another name, start it with "
        "--allow-host NAME.",
    )
