"""Sanitizing of user text for generated files, pages and the terminal: one function for each target language.

For code and Markdown a function keeps only the characters of an allow-list: letters and digits of any script, some
ASCII signs and some typographic ones. No character that could end a comment or a string (backslash, quote, control
character, line break) is on the list. Quotes become typographic ones, line breaks and tabs become spaces, and the rest
becomes U+FFFD, which every editor shows. XML, HTML and the terminal keep all characters that can be displayed, and
show where there was an invisible one.

Templates get such text as ``UserText``, which cannot become a string by accident: the environment of the template's
language (``codegen.base.text``) prints it by that language's function, and any other conversion raises.
"""

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass

from codegen.base.errors import BadInput

REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
"""U+FFFD, which replaces each character that is not allowed."""
PUNCTUATION = ".,:;()[]{}<>+-=_%&@!?~*/^|# "
"""ASCII signs that end no comment of C, Python, CMake, Make or SMT-LIB by themselves."""
TYPOGRAPHIC = "–—‘’“”·°×±§…"
"""Typographic signs that are allowed."""
QUOTES = {"'": "’", '"': "”", "`": "’"}
"""ASCII quotation mark → its typographic form."""
_BREAKS = {"\r\n": " ", "\n": " ", "\r": " ", "\t": " "}
"""Line break or tab → blank."""
_INVISIBLE = "\u115f\u1160\u3164\uffa0\u034f\u17b4\u17b5\u180b\u180c\u180d\u180f\u2800"
"""Letters, marks and signs by their Unicode category, but invisible: fillers, joiners and an empty Braille cell."""
_COMMENT_MARKS = re.compile(r"(?<=\*)(?=/)|(?<=/)(?=\*)|(?<=\?)(?=\?)")
"""Positions inside ``/*``, ``*/`` and ``??`` (trigraphs), where a blank is inserted."""
_NOT_ASCII = re.compile(r"[^ -~]")
"""Characters that ``markup_text`` checks one by one. Printable ASCII is skipped for speed: an embedded picture has a
hundred thousand such characters."""
_BLANKS = "\n\t\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}"
"""Characters that a terminal shows, though ``str.isprintable`` says no."""
_SELECTORS = re.compile("[\ufe00-\ufe0f\U000e0100-\U000e01ef]")
"""Variation selectors: invisible, they choose between forms of the character before them."""


@dataclass(frozen=True, repr=False)
class UserText:
    """Text from a user: free text of a spec, or the name of a file.

    Attributes:
        raw: the text unchanged, for JSON, whose writer escapes it.
    """

    raw: str

    def __bool__(self) -> bool:
        return bool(self.raw.strip())

    def __str__(self) -> str:
        raise TypeError("text of a user is printed by the function of its target language, not as it stands")

    def __repr__(self) -> str:
        return f"UserText({len(self.raw)} characters)"


def is_letter(character: str) -> bool:
    """Whether it is a letter or a digit of any script."""
    return unicodedata.category(character)[0] in "LN" and character not in _INVISIBLE


def _allowed(text: str, signs: str) -> str:
    """The text as one line of letters, digits and these signs, in Unicode's composed form (NFC); the rest replaced."""
    for old, new in _BREAKS.items():
        text = text.replace(old, new)
    composed = unicodedata.normalize("NFC", text)
    return "".join(c if c in signs or is_letter(c) else QUOTES.get(c, REPLACEMENT) for c in composed).strip()


def c_text(text: str) -> str:
    """Text for a comment or a string of C; no trigraph, and neither ``/*`` nor ``*/``."""
    return _COMMENT_MARKS.sub(" ", line_text(text))


def line_text(text: str) -> str:
    """Text for a docstring, comment or string of Python, or a line comment of CMake or a Makefile."""
    return _allowed(text, PUNCTUATION + TYPOGRAPHIC)


def smt_text(text: str) -> str:
    """Text for a comment of SMT-LIB; the apostrophe, which marks a transposed vector, is kept."""
    return _allowed(text, PUNCTUATION + TYPOGRAPHIC + "'")


def markdown_text(text: str) -> str:
    """Text for a code span of Markdown, in a table or elsewhere; never empty, as `` `` `` would be no code span."""
    signs = "".join(sign for sign in PUNCTUATION + TYPOGRAPHIC if sign not in "<>|&[]{}")
    return _allowed(text, signs) or REPLACEMENT


def markup_text(text: str) -> str:
    """Text for XML and HTML, line breaks included; ``codegen.base.text`` then escapes ``&``, ``<`` and quotes."""
    return _NOT_ASCII.sub(lambda match: match[0] if _is_shown(match[0]) else REPLACEMENT, text)


def comment_text(text: str) -> str:
    """A line of an XML comment, in which ``--`` is not allowed."""
    # Twice, since the first pass leaves `- --` of `---`.
    return markup_text(text).replace("--", "- -").replace("--", "- -").rstrip()


def _is_shown(character: str) -> bool:
    """Whether XML allows the character and editors display it.

    Excluded are controls, line separators (Zl, Zp), and format characters (Cf): those of no width, with which two names
    look alike, and those that show text in another order than the file has.
    """
    if character in "\n\t":
        return True
    hidden = unicodedata.category(character) in ("Cc", "Cf", "Cn", "Cs", "Zl", "Zp")
    return not (hidden or character in _INVISIBLE or _SELECTORS.match(character))


def terminal_text(text: str) -> str:
    """Text for a screen: lines of printable characters; all others as escapes such as \\x1b, so none is obeyed."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in _BLANKS else _escape(c) for c in text)


def one_line(text: str) -> str:
    """Text for a message: printable characters alone, line breaks written as escapes too."""
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def brief(text: str, longest: int = 40) -> str:
    """Text of a user's file in a form for messages: one line of printable characters, cut off after ``longest``."""
    printable = one_line(text[: longest + 1])  # one character more, to know whether something is cut off
    return printable if len(printable) <= longest else f"{printable[:longest]}…"


def foreign_letter(text: str) -> str:
    """The words " with the letter CYRILLIC SMALL LETTER ES" for the first letter or digit beyond ASCII."""
    letter = next((c for c in text if c.isalnum() and not c.isascii()), "")  # it may look Latin
    return f" with the {'letter' if letter.isalpha() else 'digit'} {_official_name(letter)}" if letter else ""


def _official_name(character: str) -> str:
    return unicodedata.name(character, f"U+{ord(character):04X}")


def _escape(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def file_text(name: str) -> str:
    """The name of a file as generated files print it: letters, digits and ``_.-+``, and ``_`` for any other sign.

    Raises BadInput for a name with a control character, a line break, a double quote or a backslash.
    """
    for character in name:
        if unicodedata.category(character) in ("Cc", "Zl", "Zp") or character in '"\\':
            found = f"a file name with the character {_official_name(character)}"
            expected = "a name of letters, digits, _, . and -, since generated files print it"
            raise BadInput(one_line(name), found, expected, code="SPEC009")
    return "".join(c if is_letter(c) or c in "_.-+" else "_" for c in unicodedata.normalize("NFC", name))


PRINTED: dict[str, Callable[[str], str]] = {
    "c": c_text,
    "python": line_text,
    "cmake": line_text,
    "make": line_text,
    "markdown": markdown_text,
    "html": markup_text,
    "xml": markup_text,
    "smt": smt_text,
    "terminal": terminal_text,
}
"""Language → its function. A language that is not here prints no text of a user at all."""
