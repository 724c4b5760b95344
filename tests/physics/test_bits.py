"""The bits of small scenes are the same on any number of threads and any instruction set."""

import bits
import pytest


@pytest.fixture(scope="module")
def found():
    return bits.hashes(1)


# Breaks when a sum is added in an order that follows from threads or registers, a product is contracted
# with a sum (fused multiply-add), or what is large enough to be divided among threads is divided by their
# number.
@pytest.mark.parametrize("isa", bits.SETS)
def test_threads_and_instruction_sets_change_no_bit(isa, found):
    if isa not in bits.sets_of_the_processor():
        pytest.skip(f"the processor has no {isa}")
    by_threads = bits.hashes_of_set(isa)
    assert set(by_threads) == {str(threads) for threads in bits.THREADS}
    for threads, hashes in by_threads.items():
        assert bits.differences(found, hashes) == [], f"{isa}, {threads} threads"


# Breaks when the hash does not see the last bit of an entry, or the comparison overlooks a scene or a law.
def test_a_bit_more_is_seen():
    assert bits.digest([1.0, 2.0]) != bits.digest([1.0, 2.0000000000000004])
    one = {"wall": {"coulomb": "a", "associated": "b"}, "chain": {"coulomb": "c"}}
    assert bits.differences(one, one) == []
    assert bits.differences(one, {"wall": {"coulomb": "a", "associated": "x"}}) == [
        "chain under coulomb",
        "wall under associated",
    ]
