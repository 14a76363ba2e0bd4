"""The simulated machines: what each controller is configured with, as texts of its files.

The numbers stand here on their own, in the controller's terms, and must describe the same machines as the project's
machine files: the tests find out whether they do. Lengths mm, angles degrees.
"""

from dataclasses import dataclass, field, replace

# Parameters of the work offset of coordinate system 1 (G54) start here, those of the next one 20 further.
WORK_OFFSETS = 5221
# Analog output that selects the kinematics.
SWITCH = 3
SELECTED = f"motion.analog-out-{SWITCH:02}"
TOOL_LENGTH = "motion.tooloffset.z"
# Samples that the buffer between controller and reader holds: milliseconds.
DEPTH = 60000
# Controller seconds that its parts wait for each other: on a busy computer with a fast clock many pass unused, and a part
# that gives up ends the program without a word.
PATIENCE = 1000


@dataclass
class Machine:
    """A kinematics module and what it is told."""

    module: str
    # In the order of its joints.
    letters: str
    # Those that take part, besides X, Y and Z.
    rotary: str
    # Pins that hold its geometry.
    pins: dict = field(default_factory=dict)
    # Pin that takes the tool length in force.
    tool_pin: str = None
    # Pin that takes a pivot length: this much plus the tool length in force.
    pivot_pin: str = None
    pivot: float = 0
    # Whether the module can be switched to identity. One that cannot has no pin to follow the tool length in force either:
    # its pivot length holds the tool from the start, and the tool table says zero.
    switchable: bool = True


def trunnion(module, letters, offset):
    pins = {"x-rot-point": 5, "y-rot-point": -7, "z-rot-point": 30, "z-offset": 10, offset: 20}
    pins = {f"{module}.{pin}": value for pin, value in pins.items()}
    return Machine(module, letters, letters[3:], pins, tool_pin=f"{module}.tool-offset")


MACHINES = {
    "xyzac-trt": trunnion("xyzac-trt-kins", "XYZAC", "y-offset"),
    "xyzbc-trt": trunnion("xyzbc-trt-kins", "XYZBC", "x-offset"),
    "bridgemill": Machine("5axiskins", "XYZBCW", "BC", pivot_pin="5axiskins.pivot-length", pivot=250),
    "head-b-table-c": Machine(
        "maxkins", "XYZABCUVW", "BC", pivot_pin="maxkins.pivot-length", pivot=100, switchable=False
    ),
}


def altered(machine, geometry):
    """The machine with other numbers: `pivot`, or pins of its module by their own names."""
    geometry = {name: float(value) for name, value in geometry.items()}
    pivot = geometry.pop("pivot", machine.pivot)
    pins = {f"{machine.module}.{name}": value for name, value in geometry.items()}
    unknown = pins.keys() - machine.pins.keys()
    if unknown:
        raise ValueError(f"{machine.module} has no {unknown}")
    return replace(machine, pivot=pivot, pins=machine.pins | pins)


def axis(letter):
    """Speed and acceleration limits as in the machine files; wide travels, as these are no matter of kinematics."""
    angular = letter in "ABC"
    travel = 36000 if angular else 2000
    speed, acceleration = (360, 3600) if angular else (500, 5000)
    return angular, f"""MIN_LIMIT = -{travel}
MAX_LIMIT = {travel}
MAX_VELOCITY = {speed}
MAX_ACCELERATION = {acceleration}
"""


def ini(machine):
    text = f"""[EMC]
VERSION = 1.1
MACHINE = rig
[DISPLAY]
DISPLAY = ./display.py
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = machine.var
SUBROUTINE_PATH = .
"""
    if machine.switchable:
        text += "REMAP = M428 modalgroup=10 ngc=m428\nREMAP = M429 modalgroup=10 ngc=m429\n"
    text += f"""[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = {PATIENCE}
SERVO_PERIOD = 1000000
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.020
TOOL_TABLE = tool.tbl
[HAL]
HALFILE = machine.hal
[KINS]
KINEMATICS = {machine.module}
JOINTS = {len(machine.letters)}
[TRAJ]
COORDINATES = {machine.letters}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = 100
MAX_LINEAR_VELOCITY = 1000
MAX_ANGULAR_VELOCITY = 720
DEFAULT_LINEAR_ACCELERATION = 5000
MAX_LINEAR_ACCELERATION = 5000
NO_FORCE_HOMING = 0
"""
    for joint, letter in enumerate(machine.letters):
        angular, limits = axis(letter)
        kind = "ANGULAR" if angular else "LINEAR"
        text += f"[AXIS_{letter}]\n{limits}[JOINT_{joint}]\nTYPE = {kind}\nHOME = 0\n{limits}"
        text += "FERROR = 1000\nMIN_FERROR = 1000\nHOME_SEARCH_VEL = 0\nHOME_LATCH_VEL = 0\nHOME_SEQUENCE = 0\n"
    return text


def columns(machine):
    """Sampled columns and their pins: five joints, five world axes in the same order, and the state of the program."""
    letters = "XYZ" + machine.rotary
    joints = [(f"j{letter}", f"joint.{machine.letters.index(letter)}.pos-cmd", "f") for letter in letters]
    world = [(f"w{letter}", f"axis.{letter.lower()}.pos-cmd", "f") for letter in letters]
    state = [
        ("tool", TOOL_LENGTH, "f"),
        ("kins", SELECTED, "f"),
        ("line", "motion.program-line", "s"),
        ("kind", "motion.motion-type", "s"),
    ]
    return joints + world + state


def hal(machine, identity_first, length):
    sampled = columns(machine)
    kinematics = machine.module + (" sparm=identityfirst" if identity_first else "")
    joints = len(machine.letters)
    lines = [
        f"loadrt {kinematics}",
        f"loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints={joints}",
        f"loadrt sampler depth={DEPTH} cfg={''.join(kind for *_, kind in sampled)}",
        "addf motion-command-handler servo-thread",
        "addf motion-controller servo-thread",
        "net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in",
        "net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared",
        "net change iocontrol.0.tool-change => iocontrol.0.tool-changed",
    ]
    # Every joint follows its command at once.
    lines += [f"net motor{n} joint.{n}.motor-pos-cmd => joint.{n}.motor-pos-fb" for n in range(joints)]
    lines += [f"setp {pin} {value}" for pin, value in machine.pins.items()]
    readers = {pin: [f"sampler.0.pin.{index}"] for index, (_, pin, _) in enumerate(sampled)}
    if machine.switchable:
        readers[SELECTED].append("motion.switchkins-type")
    if machine.tool_pin:
        readers[TOOL_LENGTH].append(machine.tool_pin)
    if machine.pivot_pin and machine.switchable:
        lines += ["loadrt sum2 names=pivot", "addf pivot servo-thread", f"setp pivot.in0 {machine.pivot}"]
        lines.append(f"net pivot pivot.out => {machine.pivot_pin}")
        readers[TOOL_LENGTH].append("pivot.in1")
    elif machine.pivot_pin:
        lines.append(f"setp {machine.pivot_pin} {machine.pivot + length}")
    lines += [f"net sampled{n} {pin} => {' '.join(to)}" for n, (pin, to) in enumerate(readers.items())]
    lines += ["addf sampler.0 servo-thread", "setp sampler.0.enable 0"]
    return "\n".join(lines) + "\n"


def files(machine, job):
    """Name to text of every file a run needs beside the program."""
    length = job["length"] if machine.switchable else 0
    first = WORK_OFFSETS + 20 * (job["system"] - 1)
    parameters = "".join(f"{first + axis}\t{value}\n" for axis, value in enumerate(job["offset"]))
    texts = {
        "machine.ini": ini(machine),
        "machine.hal": hal(machine, job["identity_first"], job["length"]),
        "machine.var": parameters,
        "tool.tbl": f"T{job['tool']} P{job['tool']} Z{length}\n",
    }
    for code, kins in ((428, job["m428_type"]), (429, 1 - job["m428_type"])):
        # Waits until the motion before has ended, then reads the positions anew.
        texts[f"m{code}.ngc"] = f"o<m{code}> sub\n  M68 E{SWITCH} Q{kins}\n  M66 E0 L0\no<m{code}> endsub\n"
    return texts
