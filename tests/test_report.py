"""The page of all studies: every figure says whether its claim holds, and nothing but its results decides its bytes."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from dataclasses import replace
from html import escape
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas
from typer.testing import CliRunner

from awiwi_gen import reproduce
from awiwi_gen.__main__ import app
from awiwi_gen.build import load
from awiwi_gen.diff.figures import Figure as DiffFigure
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, Proof, cached_tree, verify
from awiwi_gen.reproduce import page
from awiwi_gen.reproduce.figures import all_figures
from awiwi_gen.reproduce.figures import fingers as figures_fingers
from awiwi_gen.reproduce.figures.fingers import coriolis, released
from awiwi_gen.reproduce.this_hand import ThisHand, this_hand
from awiwi_gen.results import Table, compared, shaded


@pytest.fixture(scope="module")
def figures(lib, hand):
    return all_figures(lib, hand)


@pytest.fixture(scope="module")
def results(figures, some_proof, hand, lib):
    job = Job(hand)
    directory = cached_tree(job)
    own = this_hand(job, directory, read_manifest(directory))
    return page.Results(figures, NUMBERS, some_proof[0], COMPARED, own)


@pytest.fixture(scope="module")
def some_results(results):
    """The same with a few figures, one of whose claims does not hold: drawing all of them takes long."""
    numbers = ("5.7", "5.16", "6.9")
    return replace(results, figures=[figure for figure in results.figures if figure.number in numbers])


@pytest.fixture(scope="module")
def some_proof(hand):
    """The proof of three kernels, one of which iterates, and their manifest."""
    job = Job(hand, only="thumb_base*")
    directory = cached_tree(job)
    return verify(job, directory), read_manifest(directory)


NUMBERS = [compared("eq. 9.9", "2.5", 2.4999, "a < b"), compared("eq. 9.10", "2.5", 2.6, "a slip")]


COMPARED = [Table("Laws & clocks", ("law", "verdict"), [("some <law>", "reached"), ("another", "refused")])]


class Tags(HTMLParser):
    """Which tags are open, which ids there are, what is loaded from elsewhere."""

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.loaded, self.images = [], [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.images += tag == "svg"
        self.ids += [given["id"]] if "id" in given else []
        addresses = [given[k] for k in ("src", "href", "xlink:href") if k in given]
        self.loaded += [each for each in addresses if not each.startswith(("#", "data:"))]
        if tag not in ("meta", "img", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def text(tmp_path_factory, hand, results, some_proof):
    path = tmp_path_factory.mktemp("page") / "report" / "index.html"
    page.write_page(path, hand, results, some_proof[1])
    return path.read_text(encoding="utf-8")


def test_every_figure_of_the_source_is_there_and_says_whether_its_claim_holds(text, figures):
    numbers = [figure.number for figure in figures]

    assert {"5.7", "5.16", "5.17", "6.9", "6.10"} <= set(numbers)
    assert numbers.index("5.7") < numbers.index("5.16") < numbers.index("6.9") < numbers.index("6.10")
    for figure in figures:
        heading = f"Figure {figure.number}: {escape(figure.title)}</h3>"
        own = text.partition(heading)[2].partition("<h3")[0]
        assert f"The claim {'holds' if figure.holds else 'does not hold'}." in own
        assert "<svg" in own
        assert "<path" in own


def test_the_page_is_whole_and_needs_no_other_file(text, figures):
    tags = Tags(text)

    assert tags.open == []
    assert tags.loaded == []
    assert tags.images == len(figures)
    assert len([name for name in tags.ids if name.startswith("figure-")]) == len(figures)


def test_the_page_shows_the_hand_first(text, results, hand):
    before = text[: text.index("<article>")]
    image = re.search(r'<img class="hand" src="data:image/svg\+xml;base64,([^"]+)"', before)
    places = [
        before.index(f'<h2 id="{each}">') for each in ("own-numbers", "capability", "workspace", "costs", "kernels")
    ]

    assert f"<title>{hand.name}: fingers with their tendons</title>" in b64decode(image[1]).decode()
    assert places == sorted(places)
    assert before.index(image[0]) < places[0]
    assert f"{results.hand.guesses} of {len(hand.quantities())} numbers are guesses" in before
    assert '<td>fingers.index.pulleys[2].radius</td><td>6\xa0mm</td><td class="guess">guess</td>' in before
    assert results.hand.guesses == len(hand.assumed())


def test_the_page_says_what_the_fingers_can_do_and_what_that_costs(text):
    torques = "<tr><td>index</td><td>pip</td><td>-1.2\xa0N\xa0m</td><td>1.2\xa0N\xa0m</td>"
    assert torques in text[text.index('<h2 id="capability">') : text.index('<h2 id="workspace">')]
    assert re.search(r"<tr><td>index</td>.*<td>21\.5\xa0g</td></tr>", text)
    assert "<tr><td>mass_matrix</td><td>" in text[text.index('<h2 id="costs">') :]


def test_a_hand_without_motors_has_no_column_for_them():
    shown = ThisHand(fingers={"jaw": [DiffFigure("torque +root", "N m", 1.2, {})]}, joints={"jaw": ("root", "end")})

    assert shown.capability == (("finger", "joint", "torque +"), [("jaw", "root", "1.2 N m"), ("jaw", "end", "-")])
    assert shown.workspace == (("finger",), [("jaw",)])


@pytest.mark.parametrize(
    ("words", "joined"),
    [("a step of 5 N m/rad in 3 ms", "a step of 5~N~m/rad in 3~ms"), ("9.81 m/s^2, 4 %", "9.81~m/s^2, 4~%"),
     ("2 kHz of 2 motors", "2~kHz of 2 motors"), ("table 5.2 and 7 joints", "table 5.2 and 7 joints")],
)  # fmt: skip
def test_no_number_is_parted_from_its_unit(words, joined):
    assert page.text_of(words) == joined.replace("~", "\xa0")


def test_the_figures_of_the_hand_are_data_too(results):
    found = results.as_dict()["hand"]

    assert {"figure": "mass", "value": "21.5", "unit": "g"} in found["fingers"]["index"]
    assert found["guesses"] == results.hand.guesses


def test_the_page_shows_every_printed_number_beside_ours(text):
    assert '<td>eq. 9.9</td><td>2.5</td><td>2.4999</td><td class="agrees">agrees</td><td>a &lt; b</td>' in text
    assert '<td class="misprint">misprint</td>' in text


def test_the_page_compares_laws(text):
    assert "Laws &amp; clocks" in text
    assert "some &lt;law&gt;" in text
    assert '<td class="reached">reached</td>' in text
    assert '<td class="refused">refused</td>' in text


def test_the_page_shows_the_proof_of_every_kernel(text, some_proof):
    proof, _ = some_proof

    assert len(proof.verdicts) == 3
    for verdict in proof.verdicts:
        assert re.search(rf"<tr><td>{verdict.name}</td>.*<td class=\"proved\">proved</td></tr>", text)
    for law in proof.laws:
        assert f">{law.statement}</td>" in text


def test_equal_results_give_equal_bytes_without_dates(tmp_path, hand, some_results, text, some_proof):
    pages = [tmp_path / "one.html", tmp_path / "other.html"]
    for path in pages:
        page.write_page(path, hand, some_results, some_proof[1])

    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert not re.search(r"20\d\d-\d\d|Matplotlib", text)


def test_text_of_a_figure_cannot_become_markup(tmp_path, hand, figures):
    bad = replace(figures[0], title="<script>alert", claim="a < b & c", holds=False)
    page.write_page(tmp_path / "bad.html", hand, page.Results([bad], [], Proof([], [])), {"kernels": []})
    written = (tmp_path / "bad.html").read_text(encoding="utf-8")

    assert "<script>alert" not in written
    assert "a &lt; b &amp; c" in written


def test_the_command_writes_the_page_and_prints_each_verdict(tmp_path, monkeypatch, some_results, some_proof, hand):
    def publish(job, path, comparison):
        page.write_page(path, hand, some_results, some_proof[1])
        return some_results

    monkeypatch.setattr(reproduce, "publish", publish)
    target = tmp_path / "index.html"
    told = CliRunner().invoke(app, ["report", "--page", str(target)])
    as_json = CliRunner().invoke(app, ["report", "--page", str(target), "--json"])

    assert told.exit_code == as_json.exit_code == 0
    assert target.exists()
    written = json.loads(as_json.stdout)
    assert [figure["number"] for figure in written["figures"]] == [figure.number for figure in some_results.figures]
    assert [number["verdict"] for number in written["numbers"]] == ["agrees", "misprint"]
    assert "figure 5.7: the claim does not hold" in told.stdout


def test_a_claw_without_an_index_has_the_figures_of_straight_tendons(root):
    claw = Hand.load(root / "examples" / "claw.toml")
    job = Job(claw, only="beak_*")
    shown = figures_fingers.figures(load(cached_tree(job), job.store), claw)

    assert [figure.number for figure in shown] == ["5.16", "5.17"]
    assert "beak" in shown[0].title
    assert all("<svg" in page.drawing(figure) for figure in shown)


def test_coriolis_terms_matter_as_far_as_figure_5_7_can_be_read(lib, hand):
    """With little damping they change the motion by many counts of a sensor, with much damping by less than one."""
    release = released(lib, hand)
    worst = dict(zip(release.readings, release.difference.max(axis=(1, 2)), strict=True))

    assert release.full[:, 0, 1] == pytest.approx(0.1)
    assert 0.05 < worst["0.1 % of each mode"] < 0.2
    assert worst["1e-3 N m s/rad in each joint"] < 5e-4
    assert not coriolis(lib, hand, hand.spring).holds


def test_many_lines_have_colours_of_their_own_and_a_bar_that_explains_them():
    axes = Canvas().add_subplot()
    shaded(axes, [0, 1], np.arange(24.0).reshape(12, 2), range(12), "gain")
    bar = next(each for each in axes.figure.axes if each is not axes)

    assert len({line.get_color() for line in axes.lines}) == 12
    assert bar.get_ylabel() == "gain"
