"""Hands with one finger, written as text, whose tendons run as a test wants: round bodies, and through them."""

from __future__ import annotations

from pathlib import Path

from awiwi_gen.hand import Hand

TENDONS, LINKS = "[[fingers.claw.tendons]]", "[[fingers.claw.links]]"


def text_of(name: str) -> str:
    """A hand file of the tests."""
    return Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8")


def hand_with(*paths: str, name: str = "wrapped_finger") -> Hand:
    """A hand of the tests with other tendons, by their paths."""
    text = text_of(name)
    tendons = "".join(f'{TENDONS}\nrest = "0 m"\npath = [{path}]\nsource = "x"\n\n' for path in paths)
    return Hand.parse(text[: text.index(TENDONS)] + tendons + text[text.index(LINKS) :])


def place(link: str, x: float, y: float, z: float, more: str = "") -> str:
    """A point of a path [mm], or a body with more keys."""
    return f'{{ link = "{link}", at = ["{x} mm", "{y} mm", "{z} mm"]{more} }},'
