"""The codes of users' errors: what each says, and what to do. A code stays when the words of its messages change.

The letters say where the fault lies: SPEC the spec or the robot file that it names, EFFECT a file with effects of the
user's own, LOG a log or its description, FILE a file or folder, CALL the command's arguments, TOOL another program.
"""

from __future__ import annotations

CODES: dict[str, tuple[str, str]] = {
    "SPEC001": ("The file is not YAML.", "Correct the syntax at the line that is named."),
    "SPEC002": (
        "The file goes beyond the limits of a spec: size, depth, aliases or digits.",
        "Write it with fewer or shorter entries.",
    ),
    "SPEC003": ("A key, or a part that others need, is missing.", "Add it."),
    "SPEC004": ("A key is not known at this place.", "Take one of the keys that are listed, or remove it."),
    "SPEC005": ("A key occurs twice, or two keys exclude each other.", "Keep one of them."),
    "SPEC006": ("A value is of another type than its key takes.", "Write a value of the type that is named."),
    "SPEC007": ("A number is outside its admissible range.", "Take a number in the range that is named."),
    "SPEC008": (
        "A name is not known: of a variable, contact, body, law, effect, observer or gain.",
        "Take one of the names that are listed, or declare it.",
    ),
    "SPEC009": ("A name cannot be used, since it is reserved or taken.", "Choose another name."),
    "SPEC010": ("An expression cannot be read.", "Write it with numbers, names, `+ - * / **` and parentheses."),
    "SPEC011": (
        "An expression has an element that the language of a spec does not have, or is too large.",
        "Use the functions of docs/specification.md.",
    ),
    "SPEC012": ("An expression has no finite real value.", "Remove the division by zero or the complex value."),
    "SPEC013": ("A unit is not known, or has two meanings.", "Write it in SI units, such as `N*m` or `kg*m^2`."),
    "SPEC014": ("The units of two quantities do not agree.", "Give each parameter its unit and look at the terms."),
    "SPEC015": ("A matrix or a list has the wrong number of entries.", "Write as many as are named."),
    "SPEC016": ("A range of names cannot be written out.", "Write a rising range such as `x1..x4`."),
    "SPEC017": (
        "The mass matrix is not symmetric and positive definite in the envelope.",
        "Look at its entries, and at the ranges of the coordinates.",
    ),
    "SPEC018": (
        "Constraints, topology or energies do not define the motion of each coordinate once.",
        "Look for equations that depend on each other, or contradict each other.",
    ),
    "SPEC019": ("Contacts slide dependently, or act on no coordinate.", "Look at the columns of the distribution."),
    "SPEC020": ("An observer or a simulation cannot take this friction law or contact.", "Take what is named instead."),
    "SPEC021": ("An effect cannot act where it is declared.", "Look up in docs/effects.md where it can act."),
    "SPEC022": (
        "The settings of the observer, or of the cancellation, exclude each other.",
        "Take the settings that are named.",
    ),
    "SPEC023": ("A gain is free where a number is needed, or no gain can be varied.", "Run `stiction gains`."),
    "SPEC024": ("The simulation section cannot be run.", "Look at duration and sample times."),
    "SPEC025": ("A declared controller cannot be run.", "Each reference needs one input that moves it, and a gain."),
    "SPEC026": ("The envelope lacks a range that a proof needs.", "Add the range that is named."),
    "SPEC027": ("The inputs cannot cancel the friction.", "Choose other contacts, or look at where the inputs enter."),
    "SPEC028": ("A quantity leaves the range of floating-point numbers.", "Look for a parameter of unusual size."),
    "SPEC029": ("A section is missing that the command needs.", "Add the section that is named."),
    "SPEC030": ("The robot file is not a robot description (URDF).", "Correct the XML at the line that is named."),
    "SPEC031": (
        "The robot has links or joints of a kind that is not supported.",
        "Use a tree of moving and fixed joints.",
    ),
    "SPEC032": ("A link's mass or inertia is missing or impossible.", "Look at its `<inertial>`."),
    "SPEC033": (
        "A slope of the force or of the observer is infinite in the envelope.",
        "Choose an envelope or a law without that point.",
    ),
    "SPEC034": ("The simulated machine is unbounded.", "Look at inputs, gains and parameters."),
    "SPEC035": ("The event-driven integration cannot simulate this machine.", "Take `--method steps`."),
    "SPEC036": (
        "This format of `export` cannot represent the machine.",
        "See docs/how-to/export_to_a_simulator.md.",
    ),
    "SPEC037": (
        "The observer has no certified bound in newtons, or one that holds nowhere in the envelope.",
        "Run `stiction certify`, which says why.",
    ),
    "EFFECT001": ("A file with effects of your own cannot be used.", "See docs/effects.md, an effect of your own."),
    "LOG001": ("A log is damaged, or is not a file of its format.", "Write it again from its source."),
    "LOG002": ("A log has a format that is not read.", "Convert it to one of the formats that are listed."),
    "LOG003": ("A column is missing.", "Name it with `--column NAME=COLUMN`, or in meta.yaml beside the log."),
    "LOG004": ("Two columns have one name, or two variables one column.", "Name each once."),
    "LOG005": ("A value is not a usable number, or a row is incomplete.", "Correct the row that is named."),
    "LOG006": ("Values are missing.", "Cut the log there, or see `missing: fill` for single ones."),
    "LOG007": ("The times of the rows do not increase.", "Sort the rows, or write times with more digits."),
    "LOG008": ("The log has pauses, or no regular sample time.", "Cut it at the pause."),
    "LOG009": ("The log is too short, or has too few stretches in motion.", "Record longer."),
    "LOG010": ("The log is too large.", "Cut it, or take fewer columns."),
    "LOG011": ("Columns or joined records differ in their length.", "Write them from one recording."),
    "LOG012": ("The unit of a column does not fit its variable.", "Correct the unit, or set `scale:`."),
    "LOG013": (
        "The meta.yaml of a log, or an option in its place, does not fit the spec or the log.",
        "Correct it as named.",
    ),
    "LOG014": ("One log is given for two purposes.", "Give each log once."),
    "LOG015": (
        "No sample of the log could be compared with the bound, by `watch`.",
        "Look at the note in its report: units and scales, or a longer stroke in one direction.",
    ),
    "FILE001": ("A file cannot be read.", "Look at its path and its permissions."),
    "FILE002": ("A file is larger than any sensible one of its kind.", "Check that it is the file you mean."),
    "FILE003": ("A file or folder cannot be written.", "Choose another folder, or make room."),
    "FILE004": ("A file exists that stiction did not write, or that it must not replace.", "Choose a new folder."),
    "FILE005": ("The name of a file cannot be used, or has an ending that is not known.", "Take an ending as named."),
    "FILE006": ("A file is not text in UTF-8.", "Save it as UTF-8."),
    "FILE007": ("There is no safe temporary folder.", "Set TMPDIR to a folder of your own."),
    "FILE008": (
        "A generated file was edited since, and would be replaced.",
        "Put the change into the spec or a file of your own, or discard it with `generate --force`.",
    ),
    "CALL001": ("An argument has an unknown value.", "Choose one that is listed."),
    "CALL002": ("Arguments exclude each other, or one is given twice.", "Leave one out."),
    "CALL003": ("The file is not a certificate, or not of the kind that the command takes.", "Run `stiction certify`."),
    "TOOL001": ("There is no C compiler that works.", "Install gcc or clang, or set CC."),
    "TOOL002": ("The compiler refuses the code, or its library cannot be loaded.", "Look at the compiler's message."),
    "TOOL003": ("A Python package is missing.", "Install it as named."),
    "TOOL004": ("The format has no place for code of this kind of computer.", "Generate it on another computer."),
}
"""Code → (what is wrong, what to do)."""
