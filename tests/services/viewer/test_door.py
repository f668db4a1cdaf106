"""Who may come in, decided from address and headers alone."""

from __future__ import annotations

import pytest

from services.viewer.door import Door

TOKEN = "a-secret_of-16-or-more"


@pytest.mark.parametrize(
    ("host", "origin", "status"),
    [
        ("127.0.0.1:8080", None, None),
        ("localhost", "http://localhost:9000", None),
        ("[::1]:8080", "http://[::1]:8080", None),
        ("LOCALHOST:8080", "http://LocalHost:8080", None),
        ("", None, 403),
        ("127.0.0.1.evil.example", None, 403),
        ("127.0.0.1:8080\n.evil.example", None, 403),
        ("evil.example:8080", "http://evil.example:8080", 403),
        ("127.0.0.1:8080", "http://evil.example", 403),
        ("127.0.0.1:8080", "http://127.0.0.1:8080\n", 403),
        ("127.0.0.1:8080", "", 403),
    ],
)
def test_without_a_token_browsers_of_this_machine_come_in(
    host: str, origin: str | None, status: int | None
) -> None:
    headers = {"Host": host} | ({} if origin is None else {"Origin": origin})
    refused = Door().refusal("/", headers)
    assert (refused and refused[0]) == status
    assert Door().cookie == ""


@pytest.mark.parametrize(
    ("target", "cookie", "let_in"),
    [
        (f"/?token={TOKEN}", "", True),
        (f"/?x=1&token={TOKEN}", "", True),
        ("/", "{own}", True),
        ("/?token=stale", "other=1; {own}", True),
        ("/", "", False),
        ("/", "rhot_00000000=" + TOKEN, False),
        (f"/{TOKEN}", "", False),
        (f"/?Token={TOKEN}", "", False),
        ("/?token=" + "x" * 100_000, "", False),
        ("/?" + "&" * 1000 + f"a=1&b=2&c=3&d=4&e=5&f=6&g=7&h=8&token={TOKEN}", "", False),
        ("//[/?token=", '"\udcff"; rhot=', False),
    ],
)
def test_with_a_token_who_has_it_comes_in(target: str, cookie: str, let_in: bool) -> None:
    door = Door(TOKEN)
    own = door.cookie.partition(";")[0]
    headers = {"Host": "desk:8080", "Cookie": cookie.replace("{own}", own)}
    assert (door.refusal(target, headers) is None) is let_in
    if let_in:
        foreign = {**headers, "Origin": "http://evil.example"}
        assert door.refusal(target, foreign) is not None
        assert door.refusal(target, {**headers, "Origin": "http://desk:8080"}) is None


def test_two_rigs_on_one_machine_keep_their_cookies() -> None:
    assert Door(TOKEN).cookie.partition("=")[0] != Door(TOKEN + "2").cookie.partition("=")[0]
