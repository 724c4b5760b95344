"""The bits of small scenes: the same on any number of threads and instruction set, and those committed."""

import json

import golden
import pytest


@pytest.fixture(scope="module")
def found():
    return golden.hashes(1)


# Breaks when a sum is added in an order that follows from threads or registers, a product is contracted
# with a sum (fused multiply-add), or what is large enough to be divided among threads is divided by their
# number.
@pytest.mark.parametrize("isa", golden.SETS)
def test_threads_and_instruction_sets_change_no_bit(isa, found):
    if isa not in golden.sets_of_the_processor():
        pytest.skip(f"the processor has no {isa}")
    by_threads = golden.hashes_of_set(isa)
    assert set(by_threads) == {str(threads) for threads in golden.THREADS}
    for threads, hashes in by_threads.items():
        assert golden.differences(found, hashes) == [], f"{isa}, {threads} threads"


# Breaks when a change alters any bit of a scene without saying so. Where that is meant, `golden.py --renew`
# writes the new hashes.
def test_bits_are_those_committed(found):
    committed = json.loads(golden.FILE.read_text())
    here = golden.this_platform()
    other = [f"{name} is {value}" for name, value in here.items() if committed["platform"].get(name) != value]
    if other:
        pytest.skip(f"golden.json holds for another platform: here {', '.join(other)}")
    assert golden.differences(committed["hashes"], found) == [], (
        "renew golden.json if these bits are meant to change"
    )


# Breaks when the hash does not see the last bit of an entry, or the comparison overlooks a scene or a law.
def test_a_bit_more_is_seen():
    assert golden.digest([1.0, 2.0]) != golden.digest([1.0, 2.0000000000000004])
    one = {"wall": {"coulomb": "a", "associated": "b"}, "chain": {"coulomb": "c"}}
    assert golden.differences(one, one) == []
    assert golden.differences(one, {"wall": {"coulomb": "a", "associated": "x"}}) == [
        "chain under coulomb",
        "wall under associated",
    ]
