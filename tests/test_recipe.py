"""Recipes: what is described here is made elsewhere, or it is said why not."""

import io

import numpy as np
import pytest

from spacecraft_sim.recipe import END, Recipe, made


class Library:
    """What recipes are made with: it gives back what it is called with."""

    VALUE = 7

    class Thing:
        """An object that can be taken further."""

        def __init__(self, *words, **named):
            self.words, self.named = words, named

        @classmethod
        def columns(cls, **named):
            return cls("columns", **named)

        def partition(self, lengths):
            return self.words, self.named, lengths


def back(*words, **named):
    """What arrives of the words of a call."""
    thing = made(io.BytesIO(Recipe("lib").Thing(*words, **named).encoded()), {"lib": Library})
    return thing.words, thing.named


@pytest.mark.parametrize(
    "value",
    [None, True, 0, -3, 1e-300, float("inf"), "", "line\nline, ü", [], [1, [2.5, "x"]], (1, (2,)),
     {"a": (1, 2), "tuple": [3]}, {}],
    ids=repr,
)  # fmt: skip
def test_plain_data_arrives_as_it_was(value):
    (found,), _ = back(value)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    "array",
    [np.arange(6.0).reshape(2, 3), np.arange(6, dtype=np.uint8)[::2], np.zeros((0, 3)),
     np.array(3.5), np.array([True, False]), np.arange(12.0).reshape(3, 4).T,
     np.array([np.nan, np.inf, -0.0], np.float32), np.array(["one", "three"])],
    ids=lambda array: f"{array.dtype}{array.shape}",
)  # fmt: skip
def test_arrays_arrive_bit_by_bit(array):
    (found,), _ = back(array)
    assert found.dtype == array.dtype
    assert found.shape == array.shape
    assert found.tobytes() == array.tobytes()


def test_arrays_between_other_words_keep_their_places():
    rows = [np.arange(n, dtype=float) for n in (3, 0, 5)]
    words, named = back(rows, "between", a=rows[2], b={"c": (rows[0], 1)})
    for found, wanted in zip(words[0], rows, strict=True):
        np.testing.assert_array_equal(found, wanted)
    assert words[1] == "between"
    np.testing.assert_array_equal(named["a"], rows[2])
    np.testing.assert_array_equal(named["b"]["c"][0], rows[0])


def test_numbers_of_numpy_become_plain():
    (found,), _ = back([np.float32(0.5), np.int64(3), np.bool_(True)])
    assert found == [0.5, 3, True]
    assert [type(x) for x in found] == [float, int, bool]


def test_attributes_calls_and_recipes_within_recipes():
    lib = Recipe("lib")
    recipe = lib.Thing.columns(x=lib.VALUE, y=[lib.Thing(1)]).partition(np.array([2, 3]))
    words, named, lengths = made(io.BytesIO(recipe.encoded()), {"lib": Library})
    assert words == ("columns",)
    assert named["x"] == 7
    assert named["y"][0].words == (1,)
    np.testing.assert_array_equal(lengths, [2, 3])


@pytest.mark.parametrize("rest", [b"", END, END + b"what was not meant"])
def test_recipes_follow_each_other_until_there_is_none(rest):
    data = b"".join(Recipe("lib").Thing(np.full(5, k)).encoded() for k in range(3))
    file = io.BytesIO(data + rest)
    for k in range(3):
        np.testing.assert_array_equal(made(file, {"lib": Library}).words[0], np.full(5, k))
    with pytest.raises(EOFError, match="no further recipe"):
        made(file, {"lib": Library})


def test_a_recipe_cut_anywhere_is_no_recipe():
    data = Recipe("lib").Thing(np.arange(4.0), [np.arange(2)]).encoded()
    for size in range(len(data)):
        with pytest.raises(EOFError):
            made(io.BytesIO(data[:size]), {"lib": Library})


@pytest.mark.parametrize("value", [object(), {1, 2}, b"bytes", 1j, np.array([None])], ids=type)
def test_what_cannot_be_told_is_refused_at_once(value):
    with pytest.raises(TypeError, match="plain data and arrays of numbers, not"):
        Recipe("lib").Thing([value]).encoded()


def test_private_names_are_not_told():
    with pytest.raises(AttributeError, match="private names, such as __class_getitem__"):
        _ = Recipe("lib").Thing.__class_getitem__


def test_a_name_that_is_not_there_is_an_error():
    with pytest.raises(AttributeError, match="Thong"):
        made(io.BytesIO(Recipe("lib").Thong.encoded()), {"lib": Library})


def test_a_recipe_reads_as_what_it_makes():
    recipe = Recipe("rr").Transform3D.columns(translation=np.zeros((1, 3))).partition([1])
    assert repr(recipe) == "rr.Transform3D.columns(...).partition(...)"
