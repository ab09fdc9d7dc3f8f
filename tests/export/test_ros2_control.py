"""The ros2_control package: compiled against stand-ins for its headers, through a controller's life, with C's bits."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from pathlib import Path

import pytest
from lxml import etree

from codegen.app.machine import load
from codegen.base.compiler import cached
from codegen.spec import read_spec
from tests.app.command import SPECS, stiction
from tests.compiled.toolchain import version

HERE = Path(__file__).parent
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]


def exported(folder: Path, spec: str) -> Path:
    done = stiction("export", SPECS / f"{spec}.yaml", "--to", "ros2_control", "-o", folder)
    assert done.code == 0, done.err
    return folder


def compiled(command: list[object]) -> None:
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("spec", "limit"), [("one_mass", 4.0), pytest.param("two_link_arm", 1e-4, marks=pytest.mark.slow)]
)
def test_the_controller_has_the_bits_of_the_plain_c_and_allocates_nothing(
    tmp_path: Path, spec: str, limit: float
) -> None:
    if shutil.which("g++") is None:
        pytest.skip("no g++")
    package, name = exported(tmp_path / "package", spec), f"stiction_{spec}_controller"
    found = read_spec(SPECS / f"{spec}.yaml")
    n, m = len(found.coordinates), len(found.inputs)
    cancelling = ", ".join(f"ahead.u_cancel_{w.name}" for w in found.inputs)
    first = next(o for o, _, _ in load(SPECS / f"{spec}.yaml").program.outputs if o.startswith("F_hat"))
    macros = {
        "NAME": spec,
        "SPACE": f"stiction_{spec}",
        "OWN_PARAMETERS": f"{spec.upper()}_PARAMETERS",
        "SIZE_MEASURED": n,
        "SIZE_COMMANDS": m,
        "CANCELLING": f"{{{cancelling}}}",
        "FIRST_ESTIMATE": first,
        "LIMIT": limit,
    }
    folders = ["-isystem", HERE / "ros2_stand_in", "-I", package / "include", "-I", package / "src"]
    folders += ["-I", package / "include" / name]
    plain = ["cc", "-std=c99", "-ffp-contract=off", *STRICT, "-c", package / f"src/{spec}.c", "-o", tmp_path / "c.o"]
    sources = [package / "src/friction_compensation.cpp", HERE / "ros2_run.cpp"]
    wrapped = ["-Wl,--wrap=malloc", "-Wl,--wrap=calloc", "-Wl,--wrap=realloc"]
    given = [f"-D{key}={value}" for key, value in macros.items()]
    options = ["-std=c++17", "-O1", "-ffp-contract=off", *STRICT, "-Wno-mismatched-new-delete", *folders, *wrapped]
    program = tmp_path / "run"

    def make() -> bytes:
        compiled(plain)
        compiled(["g++", *options, *given, *sources, tmp_path / "c.o", "-o", program])
        return program.read_bytes()

    read = [
        path.read_bytes() for folder in (package, HERE) for path in sorted(folder.rglob("*.[ch]*")) if path.is_file()
    ]
    used = [*map(str, [*options, *given]), *(hashlib.sha256(content).hexdigest() for content in read)]
    used = [part.replace(str(tmp_path), "") for part in used]
    program.write_bytes(cached(["ros2_control", version("cc"), version("g++"), *used], make))
    program.chmod(0o700)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    last = done.stdout.splitlines()[-1]
    assert last.startswith("same; faults 20, limited ") and 0 < int(last.split()[-1]) < 2000 * m


def test_the_package_is_complete(tmp_path: Path) -> None:
    package, name = exported(tmp_path / "package", "two_mass"), "stiction_two_mass_controller"
    made = etree.parse(package / "package.xml").getroot()
    assert made.findtext("name") == name and made.get("format") == "3" and made.findtext("license")
    plugin = etree.parse(package / "plugin.xml").getroot()
    (entry,) = plugin
    assert plugin.get("path") == name
    assert entry.get("base_class_type") == "controller_interface::ChainableControllerInterface"
    assert entry.get("type") in (package / "src/friction_compensation.cpp").read_text()
    build = (package / "CMakeLists.txt").read_text()
    assert f"project({name} " in build and all(
        (package / part.strip(")")).is_file() for part in build.split() if part[:4] == "src/"
    )
    readme = (package / "README.md").read_text()
    assert "`x2/effort` in N" in readme and "Certified rate" in readme and "not run under ROS" in readme
    again = stiction("export", SPECS / "two_mass.yaml", "--to", "ros2_control", "-o", package)
    assert again.code == 0


def test_friction_that_no_input_reaches_is_refused(tmp_path: Path) -> None:
    """As of the `cancellation:` section: an export that compensates nothing would be of no use."""
    text = (SPECS / "one_mass.yaml").read_text()
    (tmp_path / "s.yaml").write_text(text.replace("  w: {unit: N}", "  w: {unit: N}").replace("  - w\n", "  - 0*w\n"))
    done = stiction("export", tmp_path / "s.yaml", "--to", "ros2_control", "-o", tmp_path / "package")
    assert done.code == 2 and not (tmp_path / "package").exists(), done


LINK = """<link name="{child}"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>
  <dynamics damping="0.1" friction="0.2"/></joint>
"""
ARM = """name: arm
urdf: arm.urdf
observer:
  kind: gto
  velocity: estimated
  gains: {K_2: [-20, -20], K_v: [100, 100]}
  sample_time: 1 ms
envelope: {shoulder_pan: [-1, 1], elbow_1_: [-1, 1], v_shoulder_pan: [-1, 1], v_elbow_1_: [-1, 1]}
"""


def test_joints_of_a_robot_file_keep_their_names(tmp_path: Path) -> None:
    """What is no letter in one is `_` in the spec; a name that no string of C++ should hold is not taken."""
    links = LINK.format(name="shoulder-pan", parent="base", child="one")
    links += LINK.format(name="elbow&quot;1&quot;", parent="one", child="two")
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm"><link name="base"/>{links}</robot>')
    (tmp_path / "arm.yaml").write_text(ARM)
    done = stiction("export", tmp_path / "arm.yaml", "--to", "ros2_control", "-o", tmp_path / "package")
    assert done.code == 0, done.err
    source = (tmp_path / "package/src/friction_compensation.cpp").read_text()
    assert source.count('{"shoulder-pan", "elbow_1_"}') == 2
