"""Options of the command line, and its refusals: argument, rule and value in one line."""

import argparse
from collections.abc import Callable, Sequence
from typing import Any, NoReturn


class Parser(argparse.ArgumentParser):
    """A parser that refuses as the package does: argument, rule and value in one line."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(message.removeprefix("argument ").removeprefix("--"))


def as_numbers(text: str) -> list[float]:
    """Numbers with commas between them."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be numbers with commas between them, got {text!r:.60}"
        ) from None


def as_library(text: str) -> Any:
    """A library of terms."""
    from .dynamics import Library

    try:
        return Library.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error).removeprefix("library: ")) from None


def as_size(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    try:
        width, height = text.split("x")
        return int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be two integers like 1920x1080, got {text!r:.60}"
        ) from None


def as_number(kind: type, rule: str) -> Callable[[str], Any]:
    """What makes a number of an option's text."""

    def number(text: str) -> Any:
        try:
            return kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"must be {rule}, got {text!r:.60}") from None

    return number


def choice(default: str, known: Sequence[str], what: str) -> dict[str, Any]:
    """An option that has one of a few values."""

    def one(text: str) -> str:
        if text not in known:
            raise argparse.ArgumentTypeError(f"must be one of {', '.join(known)}, got {text!r:.60}")
        return text

    return {"default": default, "type": one, "metavar": f"{{{','.join(known)}}}", "help": what}


def count(default: int | None, what: str) -> dict[str, Any]:
    """An option that is an integer."""
    return {"default": default, "type": as_number(int, "an integer"), "help": what}


def words(metavar: str, what: str, **more: object) -> dict[str, Any]:
    """An argument or an option that is text, or is made of it."""
    return {"metavar": metavar, "help": what, **more}
