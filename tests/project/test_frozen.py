"""Classes of `frozen` behave as those of `dataclass(frozen=True)`."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle

import pytest

from petcontact.frozen import frozen


@frozen
class Load:
    part: str
    values: list[float] = dataclasses.field(default_factory=list, compare=False)
    name: str = dataclasses.field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.part.upper())


@frozen
class Named(Load):
    factor: float = 1.0

    def __repr__(self) -> str:
        return f"<{self.name}>"


LIKE = dataclasses.make_dataclass("Load", [("part", str), ("values", list)], frozen=True)


def test_values_compare_hash_and_print_as_those_of_dataclasses():
    one, other, child = Load("top", [1.0]), Load("top"), Named("top", [1.0], 2.0)
    assert one == other and hash(one) == hash(other) and one != Load("left") and one != child
    assert repr(one) == repr(LIKE("top", [1.0])) and repr(child) == "<TOP>"
    assert pickle.loads(pickle.dumps(child)) == copy.deepcopy(child) == child
    assert (
        dataclasses.replace(child, factor=3.0) == Named("top", [1.0], 3.0)
        and dataclasses.asdict(child)["factor"] == 2.0
    )


@pytest.mark.parametrize("name", ["part", "name", "missing"])
def test_no_field_is_set_again_and_none_is_added_or_deleted(name):
    load = Named("top")
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(load, name, "left")
    with pytest.raises(dataclasses.FrozenInstanceError):
        delattr(load, name)
    assert load == Named("top")


def test_a_plain_subclass_has_attributes_of_its_own():
    class Noted(Load):
        pass

    load = Noted("top")
    load.note = "a user's own"
    load.note = "another"
    assert load.note == "another" and load == Noted("top")
    with pytest.raises(dataclasses.FrozenInstanceError):
        load.part = "left"


def test_a_dataclass_of_a_users_own_may_inherit():
    Own = dataclasses.dataclass(frozen=True)(
        type("Own", (Load,), {"__annotations__": {"factor": float}, "factor": 2.0})
    )
    assert Own("top") == Own("top", factor=2.0) != Own("top", factor=3.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        Own("top").part = "left"


def test_records_are_made_with_the_parameters_of_dataclasses():
    @frozen
    class Step:
        record: int
        self_: float = 2.0
        cycles: list[int] = dataclasses.field(default_factory=list, kw_only=True)
        name: str = "load"

    made = Step(1, name="unload", cycles=[3])
    assert (made.record, made.self_, made.cycles, made.name) == (1, 2.0, [3], "unload")
    assert Step(1).cycles == [] and Step(1).cycles is not Step(1).cycles
    like = dataclasses.make_dataclass(
        "Like", [(item.name, item.type, item) for item in dataclasses.fields(Step)]
    )
    assert list(inspect.signature(Step).parameters) == list(inspect.signature(like).parameters)
    for wrong in ({}, {"record": 1, "other": 2}):
        with pytest.raises(TypeError, match=r"Step\.__init__"):
            Step(**wrong)
