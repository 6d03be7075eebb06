"""The lines of a case file that is made for a user to edit: values with their meanings."""

from exfit.models.sheet import Parameter

MEANING_AT = 24  # column of the comments


def parameter_line(row: Parameter, value: str, indent: str, remark: str = "") -> str:
    """Return the line of a parameter, with its unit and meaning as a comment."""
    return commented(f"{indent}{row.symbol}: {value}", f"{row.unit}, {row.meaning}{remark}")


def commented(text: str, comment: str) -> str:
    """Return a line of a case with a comment, at one place where the line is short."""
    return f"{text:{MEANING_AT}}# {comment}" if len(text) < MEANING_AT else f"{text}  # {comment}"
