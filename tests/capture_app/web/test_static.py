"""The page itself, as it is served."""

import pytest


@pytest.mark.parametrize("path", ["/", "/static/app.js", "/static/viewer/viewer.js"])
def test_the_page_is_served_and_asked_for_again(client, path: str):
    answer = client.get(path)
    assert answer.status_code == 200
    assert answer.headers["cache-control"] == "no-cache"
    again = client.get(path, headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code in (200, 304)
