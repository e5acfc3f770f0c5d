"""The gallery: what is linked is there, pictures are small, a flight that diverges is left out."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

ROOT = Path(__file__).parent.parent
SCRIPTS = ROOT / "scripts"


@pytest.fixture(autouse=True)
def beside_the_scripts(monkeypatch):
    monkeypatch.syspath_prepend(SCRIPTS)


def script():
    spec = importlib.util.spec_from_file_location("script_gallery", SCRIPTS / "gallery.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def card(**changes):
    from support.gallery_page import Card

    plain = {"name": "one", "title": "A <b> flight", "description": "It flies.", "facts": ("bus",)}
    return Card(**{**plain, "kept": 3, "claims": 3, **changes})


def links(text):
    return set(re.findall(r'(?:href|src)="([^"#]+)"', text)) - {"data:,"}


@pytest.mark.slow
def test_every_link_of_the_index_leads_somewhere(tmp_path, capsys):
    out = tmp_path / "gallery"
    words = ["efremov-local", "efremov-observed", "--duration", "2", "--out", str(out)]
    assert script().main(words) == 0
    shown = capsys.readouterr().out
    text = (out / "index.html").read_text(encoding="utf-8")
    found = links(text)
    assert len(found) == 8  # picture, report, recording and scenario of each
    for link in found:
        assert not link.startswith(("/", "http", "file"))
        assert (out / link).is_file(), link
    for name in ("efremov-local", "efremov-observed"):
        assert name in shown
        assert (out / f"{name}.png").stat().st_size < 400_000
        assert "duration = 2.0" in (out / name / "scenario.toml").read_text(encoding="utf-8")


def test_a_flight_that_diverges_is_named_and_left_out(tmp_path, monkeypatch, capsys):
    from support import gallery_flight

    def fly(name, duration, out):
        if name == "efremov-local":
            raise ArithmeticError("diverged before t = 3 s")
        return card(name=name)

    monkeypatch.setattr(gallery_flight, "fly", fly)
    words = ["efremov-local", "efremov-nonlocal", "--out", str(tmp_path / "gallery")]
    assert script().main(words) == 3
    assert "efremov-local: diverged before t = 3 s" in capsys.readouterr().err
    text = (tmp_path / "gallery" / "index.html").read_text(encoding="utf-8")
    assert "efremov-nonlocal/report.html" in text
    assert "efremov-local" not in text


@pytest.mark.parametrize("words", [["efremov-lokal"], ["--duration", "soon"]])
def test_what_is_not_known_is_refused_before_anything_flies(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        script().main(words)
    assert end.value.code == 2
    assert list(tmp_path.iterdir()) == []


def test_the_index_counts_and_escapes():
    from support import gallery_page

    cards = [card(), card(name="two", kept=1), card(name="three", kept=0, claims=1)]
    text = gallery_page.page(cards, "Flights & more")
    assert "1 of 3 runs keep all claims" in text
    for words in ("3 of 3 claims hold", "1 of 3 claims hold", "0 of 1 claim holds"):
        assert words in text
    assert "A &lt;b&gt; flight" in text
    assert "Flights &amp; more" in text
    assert re.findall(r'<section class="(\w+)"', text) == ["holds", "fails", "fails"]


def test_a_shrunk_picture_looks_the_same(tmp_path):
    from support import gallery_page

    source, target = tmp_path / "large.png", tmp_path / "small.png"
    rng = np.random.default_rng(0)
    colors = rng.integers(0, 256, (12, 3))
    pixels = colors[rng.integers(0, 12, (200, 300))].astype(np.uint8)
    Image.fromarray(pixels).save(source, compress_level=1)
    gallery_page.shrink(source, target)
    assert target.stat().st_size < source.stat().st_size / 2
    with Image.open(target) as small:  # twelve colours of ninety-six: each has its own
        np.testing.assert_allclose(np.asarray(small.convert("RGB")), pixels, atol=4)


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("*.png")), ids=lambda p: p.name)
def test_pictures_of_the_readme_are_small_and_shown(path):
    assert path.stat().st_size < 400_000
    assert imread(path).shape[1] >= 1200
    assert f"(docs/{path.name})" in (ROOT / "README.md").read_text(encoding="utf-8")
