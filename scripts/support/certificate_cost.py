"""What a certificate costs: four booms as shipped, and chains of up to 200 hinges."""

import statistics

import mujoco

from spacecraft_sim import certificate_curves, certificate_input
from spacecraft_sim.certificate import certify
from spacecraft_sim.elastic_influence import worst_case
from spacecraft_sim.elastic_mjcf import elastic_model, with_elastic_masses
from support.flight_cost import seconds, spread

HINGES = (4, 12, 50, 100, 200)
TORQUE, DWELL = 0.02, 2.0  # N m and s
BOOMS = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
HEAD = """<mujoco><option gravity="0 0 0"><flag contact="disable"/></option><worldbody>
<body name="bus"><freejoint/><inertial pos="0 0 0" mass="400" diaginertia="260 290 250"/>
"""


def four_booms(*, rounds: int) -> None:
    """Prints the cost of certifying the shipped machine, remedies, and worst cases over the dwell.

    Args:
        rounds: How often.
    """
    craft = certificate_input.read("four_boom")

    def certified() -> None:
        certify(
            elastic_model(craft.model),
            torque=craft.torque,
            dwell=craft.dwell,
            lighter=lambda factor: elastic_model(with_elastic_masses(craft.model, factor)),
        )

    def searched() -> None:
        elastic = elastic_model(craft.model)
        certificate_curves.curves(
            craft.model, elastic, torque=craft.torque, dwell=craft.dwell, flown=()
        )

    certified()  # imports
    without = [seconds(certified) for _ in range(rounds)]
    with_worst = [seconds(searched) for _ in range(rounds)]
    print(f"certificate of four booms with 12 modes, remedies included: {spread(without)} s")
    print(f"  exact worst cases about three axes over the dwell: {spread(with_worst)} s")


def growth(*, rounds: int) -> None:
    """Prints the cost over the number of hinges.

    Args:
        rounds: How often.
    """
    certify(elastic_model(mujoco.MjModel.from_xml_string(chains(4))), torque=TORQUE, dwell=DWELL)
    base = None  # imports are over
    for hinges in HINGES:
        model = mujoco.MjModel.from_xml_string(chains(hinges))
        times, worst = [], []
        for _ in range(rounds):
            elastic = elastic_model(model)
            times.append(seconds(lambda e=elastic: certify(e, torque=TORQUE, dwell=DWELL)))
            worst.append(
                seconds(lambda e=elastic: worst_case(e, torque=TORQUE, dwell=DWELL, axis="z"))
            )
        each = statistics.median(times)
        base = base or each
        print(
            f"  {hinges:3d} hinges: {1e3 * each:6.0f} ms, {each / base:5.1f} times that of"
            f" {HINGES[0]}; worst case about an axis {1e3 * statistics.median(worst):6.0f} ms"
        )


def chains(hinges: int) -> str:
    """Returns the MJCF of a bus with four booms of hinged links.

    Args:
        hinges: In all, a multiple of four.
    """
    links = hinges // len(BOOMS)
    length, mass = 4.0 / links, 2.0 / links
    body = "".join(_boom(root, links, length, mass) for root in BOOMS)
    return f"{HEAD}{body}</body></worldbody></mujoco>"


def _boom(root: tuple[int, ...], links: int, length: float, mass: float) -> str:
    x, y, z = root
    text = ""
    for k in range(links):
        at = " ".join(str((1.0 if k == 0 else length) * c) for c in root)
        tip = " ".join(str(length * c) for c in root)
        axis = f"{-y} {x} {z}" if k % 2 else "0 0 1"
        text += (
            f'<body pos="{at}"><joint axis="{axis}" stiffness="{30.0 * links}" damping="0.6"/>'
            f'<inertial pos="{tip}" mass="{mass}" diaginertia="1e-4 1e-4 1e-4"/>'
        )
    return text + "</body>" * links
