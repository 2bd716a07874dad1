"""The hand on a page, in a browser: its kernels have the native bits, sliders move it, it falls, everybody can use it."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from chromium import Browser
from commands import ONE_FINGER
from tools import without

from awiwi_gen import extras
from awiwi_gen.build import load
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, Proof, cached_tree
from awiwi_gen.reproduce import page
from awiwi_gen.reproduce.this_hand import ThisHand
from awiwi_gen.web import Live, live_hand
from awiwi_gen.web.module import runnable
from awiwi_gen.web.scene import scene

SAMPLES = 4
PALM = """
[fingers.jaw.base]
position = ["40 mm", "5 mm", "-3 mm"]
rpy = ["10 deg", "0 deg", "90 deg"]
source = "drawing 9"

[palm]
source = "drawing 9"

[[palm.joints]]
joint = "bend"
low = "-1 rad"
high = "1 rad"
offset = ["50 mm", "0 mm", "0 mm"]
source = "drawing 9"
"""
HEX = "const bits = xs => Array.from(new BigUint64Array(Float64Array.from(xs).buffer));"
HEX += " const hex = xs => bits(xs).map(x => x.toString(16).padStart(16, '0'));"


def bits(values) -> list[str]:
    return [f"{each:016x}" for each in np.asarray(values, float).reshape(-1).view(np.uint64)]


def written(folder, hand: Hand, only: str = "*"):
    """A page with nothing but the moving hand, and what was generated."""
    if find_spec("ziglang") is None:
        without("ziglang (make .venv-web/installed; PYTHONPATH=$PWD/.venv-web)")
    job = Job(hand, only=only)
    directory = cached_tree(job)
    manifest = read_manifest(directory)
    shown = ThisHand(live_hand(hand, directory, manifest, job.store))
    assert isinstance(shown.live, Live)
    page.write_page(folder / "page.html", hand, page.Results([], [], Proof([], []), (), shown), manifest)
    return folder / "page.html", load(directory, job.store)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


@pytest.fixture(scope="module")
def awiwi(tmp_path_factory, hand):
    return written(tmp_path_factory.mktemp("awiwi"), hand)


@pytest.fixture
def opened(browser, awiwi):
    """The page of the Awiwi hand, just opened."""
    browser.errors.clear()
    browser.open(awiwi[0])
    browser.ask("ready")
    return browser


def test_every_kernel_of_the_page_gives_the_bits_of_the_native_library(opened, awiwi):
    library = awiwi[1]
    names = opened.ask("Object.keys(hand.kernels)")
    random = np.random.default_rng(18)
    cases = []
    for name in names:
        ports = library[name].inputs
        for _ in range(SAMPLES):
            inputs = [random.uniform(np.array(p["low"], float), p["high"]) for p in ports]
            cases.append((name, [each.tolist() for each in inputs]))
    asked = (
        f"{HEX} ({json.dumps(cases)}).map(([name, inputs]) => Object.values(hand.kernels[name](...inputs)).map(hex))"
    )
    found = opened.ask(f"(() => {{ {asked.replace('; (', '; return (')} }})()")

    assert len(names) == 5 * 9 + 3
    for (name, inputs), outputs in zip(cases, found, strict=True):
        shapes = [port["shape"] for port in library[name].inputs]
        result = library[name](*(np.reshape(each, shape) for each, shape in zip(inputs, shapes, strict=True)))
        expected = result if isinstance(result, tuple) else (result,)  # guarded ones have a status behind their outputs
        assert outputs == [bits(each) for each in expected[: len(library[name].outputs)]], name


def test_a_slider_moved_by_keys_moves_the_finger_and_its_numbers(opened, awiwi):
    before = opened.ask("[document.getElementById('view').toDataURL(), hand.q.index[2]]")
    opened.ask("document.querySelectorAll('details.group')[2].open = true; document.getElementById('index-2').focus()")
    opened.press("ArrowRight", times=5)
    after, q, tip, length = opened.ask(
        "[document.getElementById('view').toDataURL(), hand.q.index, document.getElementById('tip').textContent,"
        " document.getElementById('tendons').rows[0].cells[1].textContent]"
    )
    pose = np.array(opened.ask("hand.base(hand.finger())")) @ awiwi[1].index_fingertip_pose(q)
    joints, wrist = opened.ask("[hand.scene.fingers.flatMap(f => hand.q[f.name]), hand.q.wrist]")
    lengths = awiwi[1].hand_tendon_lengths(joints, wrist).h

    assert opened.ask("document.getElementById('shown').value") == "index"
    assert q[2] > before[1] + 0.01
    assert after != before[0]
    assert ", ".join(f"{1e3 * x:.2f}\xa0mm" for x in pose[:3, 3]) in tip
    assert length == f"{1e3 * lengths[8]:.3f}\xa0mm"
    opened.press("End")
    assert bits(opened.ask("hand.q.index[2]")) == bits(float(Hand.load().fingers["index"].links[2].high))
    assert opened.errors == []


def test_stiffness_and_manipulability_are_those_of_the_native_kernels(opened, awiwi):
    library = awiwi[1]
    opened.ask("document.getElementById('shown').value = 'ring'; hand.set('ring', 1, 0.7)")
    q, tension, compliance = opened.ask(
        "[hand.q.ring, Number(document.getElementById('tension').value), hand.compliance.map(each => each.value)]"
    )
    f = np.full(len(library.finger("ring").tendons), tension)
    K = library.ring_joint_stiffness(q, f, library.ring_tendon_stiffness(f).k)
    J = library.ring_jacobian(q)[:3]
    manipulability = np.prod(np.linalg.svd(J, compute_uv=False))
    said = opened.ask("document.getElementById('tip').rows[2].cells[1].textContent")

    np.testing.assert_allclose(compliance, np.linalg.eigvalsh(J @ np.linalg.inv(K) @ J.T)[::-1], rtol=1e-9, atol=1e-12)
    assert float(said.partition("\xa0")[0]) == pytest.approx(manipulability, rel=1e-3)


def test_a_dropped_finger_takes_the_steps_of_the_native_equations_of_motion(opened, awiwi):
    library, steps = awiwi[1], 60
    start = [0.1, 1.48, 0.4, 0.3]  # near a stop, with which it soon collides
    fell = opened.ask(
        f"{{ const f = hand.scene.fingers[1]; const fall = new Fall(hand.kernels, f, {start}, [0, 0, 9.81]);"
        f" fall.qd[1] = 20; for (let i = 0; i < {steps}; i++) fall.step(); {HEX} [hex(fall.q), hex(fall.qd)] }}"
    )
    step, stop, calm = 2.5e-5, 2 * np.pi * 60, 0.25
    low, high = library.finger("index").joint_limits
    q, qd = np.array(start), np.array([0, 20.0, 0, 0])
    middle = np.array(opened.ask("hand.scene.fingers[1].middle"))
    inertia = np.diag(library.index_mass_matrix(middle))
    hit = False
    for _ in range(steps):
        over = np.where(q < low, q - low, np.where(q > high, q - high, 0.0))
        tau = np.where(over != 0, 0.0 - inertia * stop * (stop * over + 2 * qd), 0.0)
        hit |= bool(over.any())
        qdd = library.index_forward_dynamics(q, qd, tau, [0, 0, 9.81])
        qd = qd + step * (qdd - qd / calm)
        q = q + step * qd

    assert hit
    assert fell == [bits(q), bits(qd)]


def test_the_button_drops_the_hand_and_holds_it_again(opened):
    before = opened.ask("hand.q")
    opened.ask("document.getElementById('drop').click()")
    assert "falling" in opened.ask("document.getElementById('told').textContent")
    opened.wait(f"Math.abs(hand.q.fifth[2] - {before['fifth'][2]}) > 0.01")
    opened.ask("document.getElementById('drop').click()")
    after = opened.ask("hand.q")

    assert opened.ask("document.getElementById('told').textContent") == "held"
    assert after["wrist"] == before["wrist"]
    assert all(np.abs(np.subtract(after[name], before[name])).max() > 1e-4 for name in before if name != "wrist")
    assert opened.errors == []


@pytest.mark.parametrize(("width", "dark"), [*product((400, 1600), (False, True))])
def test_the_page_is_readable_at_every_width_light_and_dark_and_asks_no_network(browser, awiwi, width, dark):
    browser.errors.clear()
    browser.asked.clear()
    browser.open(awiwi[0], width, 800, dark)
    browser.ask("ready")
    seen = browser.ask(
        "[document.documentElement.scrollWidth, document.getElementById('view').clientWidth,"
        " getComputedStyle(document.body).backgroundColor, document.getElementById('contents').open,"
        " [...document.querySelectorAll('.slider output')].every(each => each.scrollWidth <= each.clientWidth + 1)]"
    )

    assert seen[0] == width
    assert seen[1] > 0.4 * width
    assert (max(map(int, re.findall(r"\d+", seen[2]))) < 100) == dark
    assert seen[3] == (width > 1200)
    assert seen[4]
    assert set(browser.asked) <= {"file", "data"}
    assert browser.errors == []


def test_every_control_has_a_name_and_a_value_for_those_who_do_not_see(opened):
    opened.ask("for (const each of document.querySelectorAll('details.group')) each.open = true")
    opened("Accessibility.enable")
    nodes = [each for each in opened("Accessibility.getFullAXTree")["nodes"] if not each["ignored"] and "name" in each]
    named = [(each["role"]["value"], each["name"]["value"]) for each in nodes]
    sliders = [name for role, name in named if role == "slider"]
    spoken = opened.ask("[...document.querySelectorAll('input')].map(each => each.getAttribute('aria-valuetext'))")

    assert len(set(sliders)) == len(sliders) == 19 + 2 + 1
    assert "index pip" in sliders
    assert all(re.fullmatch(r"-?[\d.]+ (degrees|newtons)", each) for each in spoken)
    assert [name for role, name in named if role == "button"] == ["Drop it", "Middle pose"]
    assert any("Arrow keys" in name for role, name in named if role in ("image", "img"))
    assert ("combobox", "Numbers of") in named


def test_the_picture_turns_by_keys(opened):
    opened.ask("document.getElementById('view').focus()")
    before = opened.ask("hand.view.turn")
    opened.press("ArrowLeft", times=2)
    turned = opened.ask("hand.view.turn")
    opened.press("Home")

    assert turned == pytest.approx(before + 0.2)
    assert opened.ask("hand.view.turn") == before


def test_a_hand_of_one_finger_without_wrist_has_a_page(browser, tmp_path):
    only = (
        "jaw_link_poses,jaw_pose_and_jacobian,jaw_tendon_lengths,jaw_tendon_stiffness,jaw_coupling,jaw_joint_stiffness"
    )
    place, library = written(tmp_path, Hand.load(ONE_FINGER), only)
    found = moved(browser, place)

    np.testing.assert_allclose(found["tip"], library.jaw_pose_and_jacobian(found["q"]["jaw"]).T[:3, 3], atol=1e-12)
    assert found["tendons"] == 3
    assert list(found["q"]) == ["jaw"]


def test_a_hand_without_tendons_has_a_page_and_stands_on_its_palm(browser, tmp_path):
    text = Path(ONE_FINGER).read_text(encoding="utf-8")
    bare = re.sub(r"^tendons = \[.*?^\]\n", "", text, flags=re.MULTILINE | re.DOTALL)
    place, library = written(
        tmp_path,
        Hand.parse(bare + PALM),
        "jaw_link_poses,jaw_pose_and_jacobian,jaw_palm_pose,palm_pose",
    )
    found = moved(browser, place)
    tip = library.palm_pose(found["q"]["wrist"]) @ library.jaw_palm_pose(found["q"]["jaw"]).T

    np.testing.assert_allclose(found["tip"], tip[:3, 3], atol=1e-12)
    assert found["tendons"] == 0
    assert found["q"]["wrist"] == [0.4]


def moved(browser, place):
    """A page of the small hand after its joints were moved: where its tip is, its angles, how many tendons have rows."""
    browser.errors.clear()
    browser.open(place)
    browser.ask("ready")
    browser.ask("hand.set('jaw', 1, 1.0); if (hand.scene.wrist) hand.set('wrist', 0, 0.4)")
    asked = (
        "({tip: hand.points(hand.finger()).at(-1), q: hand.q, tendons: document.getElementById('tendons').rows.length})"
    )
    found = browser.ask(asked)
    if len(found["q"]) == 1:  # the file does not say where the finger stands
        base = np.array(browser.ask("hand.base(hand.finger())"))
        found["tip"] = base[:3, :3].T @ (found["tip"] - base[:3, 3])
    assert browser.ask("document.getElementById('drop').disabled")  # no kernels of dynamics were generated
    assert browser.errors == []
    return found


def test_without_the_compiler_the_page_says_what_to_install(monkeypatch, tmp_path, hand):
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name == "ziglang" else find_spec(name))
    shown = ThisHand(live_hand(hand, tmp_path, {"kernels": []}, Job(hand).store))
    page.write_page(tmp_path / "page.html", hand, page.Results([], [], Proof([], []), (), shown), {"kernels": []})
    text = (tmp_path / "page.html").read_text(encoding="utf-8")

    assert not shown.as_dict()["moves"]
    assert shown.lacking.endswith("install it: pip install 'awiwi_gen[browser]'.")
    assert "needs ziglang; install it: pip install &#x27;awiwi_gen[browser]&#x27;" in text
    assert "<canvas" not in text


def test_kernels_that_need_a_library_of_c_are_left_out(tmp_path):
    (tmp_path / "plain.c").write_text("double f(double x) { return sqrt(x) + awiwi_atan(x); }", encoding="utf-8")
    (tmp_path / "calls.c").write_text("double f(double x) { return acos(x); }", encoding="utf-8")

    assert runnable(tmp_path, ["plain", "calls"]) == ["plain"]


def test_points_of_tendons_are_fixed_to_links(hand, lib):
    """Those of the thumb's spans are where the kernel of lengths has them, whatever the pose."""
    finger = scene(hand, lib.manifest, [])["fingers"][0]
    q = [0.2, -0.3, 0.5, 0.4]
    poses = [np.eye(4), *lib.thumb_link_poses(q)]
    for tendon in range(4):
        (start, end) = finger["tendons"][tendon]["lines"][0]
        a, b = (poses[link + 1] @ [*at, 1.0] for link, at in (start, end))
        assert np.linalg.norm(a - b) == pytest.approx(lib.thumb_tendon_lengths(q)[tendon], abs=1e-12)
