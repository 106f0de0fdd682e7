"""The figures of a panel's arms: who gets them, and what they say."""

from __future__ import annotations

import aiohttp
import pytest
from panel_rig import page, shown

VIEWER, OPERATOR = "viewer-token-0815", "operator-token-4711"


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Authorization": f"Bearer {VIEWER}"}, 200),
        ({"Authorization": f"Bearer {OPERATOR}"}, 200),
        ({"Authorization": "Bearer wrong"}, 401),
        ({"Authorization": f"Basic {VIEWER}"}, 401),
        ({}, 401),
        ({"Authorization": f"Bearer {VIEWER}", "Host": "rebound.example"}, 421),
    ],
)
async def test_who_has_a_token_gets_the_figures(headers: dict[str, str], status: int) -> None:
    async with (
        shown(operator_token=OPERATOR, viewer_token=VIEWER) as rig,
        page(rig),
        aiohttp.ClientSession() as http,
        http.get(f"{rig.panel.url}metrics", headers=headers) as answer,
    ):
        text = await answer.text()
        assert answer.status == status
        assert ('dobot_queue_pending{arm="' in text) == (status == 200)
        assert answer.headers["Content-Type"].startswith("text/plain")


async def test_a_token_opens_nothing_else() -> None:
    headers = {"Authorization": f"Bearer {OPERATOR}"}
    async with (
        shown(operator_token=OPERATOR, viewer_token=VIEWER) as rig,
        aiohttp.ClientSession() as http,
        http.get(rig.panel.url, headers=headers) as answer,
    ):
        assert answer.status == 401
