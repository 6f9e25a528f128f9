# SPDX-License-Identifier: Apache-2.0
"""mac_rx and mac_tx against the MII source and sink of cocotbext-eth, whose FCS is zlib's: scripts/mac_opinion.sh.

Every test states what the other side sent or saw; nothing here uses the project's own models.
"""
import random
import struct
import zlib

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge
from cocotbext.eth import GmiiFrame, MiiSink, MiiSource

PERIOD = 40  # ns: 25 MHz
NIBBLES_OF_GAP = 24


class Bench:
    def __init__(self, dut):
        self.dut = dut
        self.random = random.Random(1)
        self.received = []  # (bytes with FCS, verdict)
        self.request = 0
        self.slot = 0

    async def start(self, full_duplex=1):
        dut = self.dut
        cocotb.start_soon(Clock(dut.clk, PERIOD, "ns").start())
        dut.rst.value = 1
        dut.full_duplex.value = full_duplex
        dut.crs.value = 0
        dut.col.value = 0
        dut.f_request.value = 0
        dut.f_length_0.value = 0
        dut.f_length_1.value = 0
        self.source = MiiSource(dut.rx_d, dut.rx_er, dut.rx_dv, dut.clk)
        await self.clocks(5)
        dut.rst.value = 0
        self.sink = MiiSink(dut.tx_d, None, dut.tx_en, dut.clk)  # not earlier: it takes no undefined bits
        cocotb.start_soon(self.collect())
        await self.clocks(40)

    async def clocks(self, count):
        for _ in range(count):
            await RisingEdge(self.dut.clk)

    async def collect(self):
        dut = self.dut
        data = bytearray()
        while True:
            await FallingEdge(dut.clk)
            if int(dut.m_valid.value) == 0:
                continue
            if int(dut.m_last.value):
                self.received.append((bytes(data), int(dut.m_data.value)))
                data = bytearray()
            else:
                data.append(int(dut.m_data.value))

    async def transmit(self, payload, wait=True):
        """Into the next slot; returns a function that waits for the answer."""
        dut, slot = self.dut, self.slot
        for i, byte in enumerate(payload):
            dut.memory[2048 * slot + i].value = byte
        (dut.f_length_1 if slot else dut.f_length_0).value = len(payload)
        await FallingEdge(dut.clk)
        self.request ^= 1 << slot
        dut.f_request.value = self.request
        self.slot ^= 1

        async def answer():
            while (int(dut.f_done.value) ^ self.request) >> slot & 1:
                await FallingEdge(dut.clk)
            return int((dut.f_result_1 if slot else dut.f_result_0).value)

        return await answer() if wait else answer

    def payload(self, size):
        return bytes(self.random.getrandbits(8) for _ in range(size))


def with_fcs(data):
    return data + struct.pack("<L", zlib.crc32(data))


@cocotb.test()
async def receive_good_frames(dut):
    """Lengths of all kinds at the source's shortest gap."""
    bench = Bench(dut)
    await bench.start()
    sizes = list(range(60, 80)) + [127, 128, 255, 256, 1513, 1514]
    sent = [bench.payload(size) for size in sizes]
    for data in sent:
        await bench.source.send(GmiiFrame.from_payload(data))
    await bench.source.wait()
    await bench.clocks(60)
    assert bench.received == [(with_fcs(data), 0) for data in sent]


@cocotb.test()
async def receive_bad_frames(dut):
    """A flipped bit, rx_er, too short, too long; a good one after each."""
    bench = Bench(dut)
    await bench.start()
    want = []
    for place in range(0, 64, 3):
        data = bytearray(with_fcs(bench.payload(60)))
        data[place] ^= 1 << bench.random.randrange(8)
        await bench.source.send(GmiiFrame.from_raw_payload(data))
        want.append((bytes(data), 1))
        good = bench.payload(70)
        frame = GmiiFrame.from_payload(good)
        frame.error = [0] * len(frame.data)
        frame.error[8 + place] = 1
        await bench.source.send(frame)
        want.append((with_fcs(good), 16))
    for size in range(5, 64, 2):
        data = with_fcs(bench.payload(size - 4))
        await bench.source.send(GmiiFrame.from_raw_payload(data))
        want.append((data, 4))
    for size in (1519, 1520, 1600):
        data = with_fcs(bench.payload(size - 4))
        await bench.source.send(GmiiFrame.from_raw_payload(data))
        want.append((data[:1518], 8))
    good = bench.payload(60)
    await bench.source.send(GmiiFrame.from_payload(good))
    want.append((with_fcs(good), 0))
    await bench.source.wait()
    await bench.clocks(60)
    assert bench.received == want


@cocotb.test()
async def transmit_frames(dut):
    """Preamble, padding, FCS and bytes as the sink understands them, and the gap of frames that wait."""
    bench = Bench(dut)
    await bench.start()
    sizes = list(range(14, 80, 3)) + [59, 60, 61, 127, 128, 255, 256, 1513, 1514]
    sent, pending = [], []
    for size in sizes:
        if len(pending) == 2:
            assert await pending.pop(0)() == 0
        sent.append(bench.payload(size))
        pending.append(await bench.transmit(sent[-1], wait=False))
    for answer in pending:
        assert await answer() == 0
    await bench.clocks(20)
    before = None
    for data in sent:
        frame = bench.sink.recv_nowait(compact=False)
        assert bytes(frame.get_preamble()) == b"\x55" * 7 + b"\xd5"
        assert bytes(frame.get_payload()) == data.ljust(60, b"\0")
        assert frame.check_fcs()
        if before is not None:
            assert frame.sim_time_start - before == NIBBLES_OF_GAP * PERIOD * 1000
        before = frame.sim_time_end
    assert bench.sink.empty()


@cocotb.test()
async def both_ways_at_once(dut):
    """Full duplex: neither direction disturbs the other."""
    bench = Bench(dut)
    await bench.start()
    incoming = [bench.payload(bench.random.randrange(60, 400)) for _ in range(12)]
    outgoing = [bench.payload(bench.random.randrange(60, 400)) for _ in range(12)]
    for data in incoming:
        await bench.source.send(GmiiFrame.from_payload(data))
    for data in outgoing:
        assert await bench.transmit(data) == 0
    await bench.source.wait()
    await bench.clocks(60)
    assert bench.received == [(with_fcs(data), 0) for data in incoming]
    for data in outgoing:
        frame = bench.sink.recv_nowait()
        assert bytes(frame.get_payload()) == data and frame.check_fcs()


@cocotb.test()
async def collisions(dut):
    """Half duplex: after a collision the sink sees a fragment without good FCS, then the whole frame."""
    bench = Bench(dut)
    await bench.start(full_duplex=0)
    for place in (1, 10, 16, 40, 100, 127):
        data = bench.payload(100)
        answer = await bench.transmit(data, wait=False)
        await RisingEdge(dut.tx_en)
        await bench.clocks(place)
        dut.col.value = 1
        await bench.clocks(1)
        dut.col.value = 0
        assert await answer() == 0
        await bench.clocks(20)
        fragment = bench.sink.recv_nowait()
        assert len(fragment.data) < 90 and not fragment.check_fcs()
        frame = bench.sink.recv_nowait()
        assert bytes(frame.get_payload()) == data and frame.check_fcs()
        assert bench.sink.empty()


@cocotb.test()
async def waits_for_carrier(dut):
    """Half duplex: nothing is sent while crs, and not for 96 bit times after it."""
    bench = Bench(dut)
    await bench.start(full_duplex=0)
    for busy in (1, 50, 500):
        dut.crs.value = 1
        await bench.clocks(5)
        answer = await bench.transmit(bench.payload(60), wait=False)
        for _ in range(busy):
            await bench.clocks(1)
            assert int(dut.tx_en.value) == 0
        dut.crs.value = 0
        quiet = 0
        while int(dut.tx_en.value) == 0:
            await bench.clocks(1)
            quiet += 1
        assert NIBBLES_OF_GAP <= quiet <= NIBBLES_OF_GAP + 8
        assert await answer() == 0
        await bench.clocks(20)
        assert bench.sink.recv_nowait().check_fcs()
