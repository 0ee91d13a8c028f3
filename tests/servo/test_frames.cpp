// SPDX-License-Identifier: MIT
// Frames: published examples, round trips, and every error that the document promises to find.
#include <gtest/gtest.h>
#include <servo/frame_writer.hpp>

#include <cstring>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "host.hpp"

namespace {

using servo::FrameReader;
using test::Packet;
using test::view;

Packet count_up(int first, int last) {
  Packet bytes(static_cast<std::size_t>(last - first + 1));
  std::iota(bytes.begin(), bytes.end(), static_cast<std::uint8_t>(first));
  return bytes;
}

Packet joined(const std::vector<Packet>& parts) {
  Packet all;
  for (const Packet& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

Packet encoded(const Packet& packet) {
  Packet to(servo::cobs_bytes(packet.size()), 0xAA);
  to.resize(servo::cobs_encode(view(packet), to.data()));
  return to;
}

/// Every byte of the frame through the decoder; `complete` as at the zero behind it.
Packet decoded(const Packet& frame, bool& complete) {
  servo::CobsDecoder decoder;
  Packet packet;
  for (const std::uint8_t byte : frame) {
    std::uint8_t out = 0;
    if (decoder.take(byte, out)) {
      packet.push_back(out);
    }
  }
  complete = decoder.complete();
  return packet;
}

void expect_round_trip(const Packet& packet) {
  const Packet frame = encoded(packet);
  for (const std::uint8_t byte : frame) {
    ASSERT_NE(byte, 0);
  }
  bool complete = false;
  ASSERT_EQ(decoded(frame, complete), packet);
  ASSERT_TRUE(complete);
}

TEST(Cobs, PublishedExamples) {
  const std::vector<std::pair<Packet, Packet>> examples = {
      // Cheshire and Baker, 1999, Fig. 3
      {{0x45, 0, 0, 0x2C, 0x4C, 0x79, 0, 0, 0x40, 0x06, 0x4F, 0x37},
       {2, 0x45, 1, 4, 0x2C, 0x4C, 0x79, 1, 5, 0x40, 0x06, 0x4F, 0x37}},
      // Wikipedia, "Consistent Overhead Byte Stuffing", encoding examples
      {{0}, {1, 1}},
      {{0, 0}, {1, 1, 1}},
      {{0, 0x11, 0}, {1, 2, 0x11, 1}},
      {{0x11, 0x22, 0, 0x33}, {3, 0x11, 0x22, 2, 0x33}},
      {{0x11, 0x22, 0x33, 0x44}, {5, 0x11, 0x22, 0x33, 0x44}},
      {{0x11, 0, 0, 0}, {2, 0x11, 1, 1, 1}},
      {count_up(1, 0xFE), joined({{0xFF}, count_up(1, 0xFE)})},
      {count_up(0, 0xFE), joined({{1, 0xFF}, count_up(1, 0xFE)})},
      {count_up(1, 0xFF), joined({{0xFF}, count_up(1, 0xFE), {2, 0xFF}})},
      {joined({count_up(2, 0xFF), {0}}), joined({{0xFF}, count_up(2, 0xFF), {1, 1}})},
      {joined({count_up(3, 0xFF), {0, 1}}), joined({{0xFE}, count_up(3, 0xFF), {2, 1}})},
  };
  for (const auto& [packet, frame] : examples) {
    EXPECT_EQ(encoded(packet), frame);
    bool complete = false;
    EXPECT_EQ(decoded(frame, complete), packet);
    EXPECT_TRUE(complete);
  }
}

TEST(Cobs, RoundTripsOfEveryLength) {
  std::mt19937 random(1);
  for (std::size_t length = 0; length <= servo::kMaxPacket; ++length) {
    expect_round_trip(Packet(length, 0));
    expect_round_trip(Packet(length, 0xFF));
    Packet packet(length);
    for (std::uint8_t& byte :
         packet) {  // runs without zeros up to beyond a block, and runs of zeros
      byte = random() % 97 == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(random());
    }
    expect_round_trip(packet);
  }
}

TEST(Crc, CheckValueOfTheCatalogue) {
  const char text[] = "123456789";
  EXPECT_EQ(servo::crc16({reinterpret_cast<const std::uint8_t*>(text), 9}), 0x29B1);
}

Packet some_packet() {
  Packet packet(25);
  std::mt19937 random(2);
  for (std::uint8_t& byte : packet) {
    byte = static_cast<std::uint8_t>(random());
  }
  const std::uint16_t crc = servo::crc16({packet.data(), 23});
  packet[23] = static_cast<std::uint8_t>(crc);
  packet[24] = static_cast<std::uint8_t>(crc >> 8U);
  return packet;
}

bool crc_right(const Packet& packet) {
  return servo::crc16({packet.data(), 23}) == (packet[23] | packet[24] << 8);
}

TEST(Crc, FindsEveryErrorOfOneAndTwoBits) {
  Packet packet = some_packet();
  ASSERT_TRUE(crc_right(packet));
  const auto flip = [&](std::size_t bit) {
    packet[bit / 8] = static_cast<std::uint8_t>(packet[bit / 8] ^ (1U << (bit % 8)));
  };
  for (std::size_t first = 0; first < 200; ++first) {
    flip(first);
    EXPECT_FALSE(crc_right(packet)) << first;
    for (std::size_t second = first + 1; second < 200; ++second) {
      flip(second);
      EXPECT_FALSE(crc_right(packet)) << first << " " << second;
      flip(second);
    }
    flip(first);
  }
}

/// What a reader gives for the bytes.
struct Found {
  std::vector<Packet> packets;
  int bad = 0;
};

Found read(const Packet& line) {
  FrameReader reader;
  Found found;
  for (const std::uint8_t byte : line) {
    if (reader.take(byte)) {
      found.packets.push_back(test::copy(reader.packet()));
    }
  }
  found.bad = reader.bad_frames.value();
  return found;
}

TEST(FrameReader, SkipsEmptyFramesWithoutCounting) {
  const Packet packet{6, 1, 0};
  const Found found = read(joined({{0, 0, 0}, test::framed(packet), {0, 0}, test::framed(packet)}));
  EXPECT_EQ(found.packets, (std::vector<Packet>{packet, packet}));
  EXPECT_EQ(found.bad, 0);
}

TEST(FrameReader, LengthsAtTheLimits) {
  for (const std::size_t length : {std::size_t{3}, servo::kMaxPacket - 2}) {
    EXPECT_EQ(read(test::framed(Packet(length, 0x55))).packets.size(), 1U) << length;
  }
  for (const std::size_t length : {std::size_t{0}, std::size_t{2}, servo::kMaxPacket - 1,
                                   servo::kMaxPacket + 1, std::size_t{70'000}}) {
    const Packet after{6, 1, 0};
    const Found found = read(joined({test::framed(Packet(length, 0x55)), test::framed(after)}));
    EXPECT_EQ(found.packets, std::vector<Packet>{after}) << length;
    EXPECT_EQ(found.bad, 1) << length;
  }
}

TEST(FrameReader, TooLongAlsoWhereItBeginsLikeAWholePacket) {
  Packet packet(servo::kMaxPacket - 2, 0x55);
  const std::uint16_t crc = servo::crc16(view(packet));
  packet.push_back(static_cast<std::uint8_t>(crc));
  packet.push_back(static_cast<std::uint8_t>(crc >> 8U));
  EXPECT_EQ(read(joined({encoded(packet), {0}})).packets.size(), 1U);
  packet.push_back(1);
  const Found found = read(joined({encoded(packet), {0}}));
  EXPECT_TRUE(found.packets.empty());
  EXPECT_EQ(found.bad, 1);
}

TEST(FrameReader, ACutFrameCostsNoOther) {
  const Packet frame = test::framed({4, 1, 0, 0, 0, 7, 8, 9});
  const Packet good{6, 2, 0};
  for (std::size_t kept = 1; kept < frame.size(); ++kept) {
    const Packet cut(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(kept));
    const Found found = read(joined({cut, {0}, test::framed(good)}));
    // Whole but for its zero, it is a frame.
    const bool whole = kept + 1 == frame.size();
    ASSERT_EQ(found.packets.size(), whole ? 2U : 1U) << kept;
    EXPECT_EQ(found.packets.back(), good);
    EXPECT_EQ(found.bad, whole ? 0 : 1) << kept;
  }
}

TEST(FrameReader, SurvivesRandomBytes) {
  std::mt19937 random(3);
  const Packet good{6, 2, 0};
  for (int round = 0; round < 2000; ++round) {
    Packet line(random() % 700);
    for (std::uint8_t& byte : line) {
      byte = static_cast<std::uint8_t>(random() % (round % 2 == 0 ? 256U : 4U));
    }
    const Found found = read(joined({line, {0}, test::framed(good)}));
    ASSERT_FALSE(found.packets.empty());
    EXPECT_EQ(found.packets.back(), good);
  }
}

TEST(FrameReader, CountsUpToTheLargestNumber) {
  FrameReader reader;
  for (int i = 0; i < 70'000; ++i) {
    reader.take(5);
    reader.take(0);
  }
  EXPECT_EQ(reader.bad_frames.value(), 0xFFFF);
}

TEST(FrameWriter, WritesWhatTheReaderReads) {
  servo::FrameWriter writer;
  servo::Writer out = writer.begin(servo::Answer::result, 0x1234);
  out.u32(0x00ABCD00U);
  out.f32(-2.5F);
  const Packet frame = test::copy(writer.finish(out));
  EXPECT_EQ(frame.front(), 0);
  EXPECT_EQ(
      read(frame).packets,
      (std::vector<Packet>{{0x84, 0x34, 0x12, 0x00, 0xCD, 0xAB, 0x00, 0x00, 0x00, 0x20, 0xC0}}));
  EXPECT_EQ(test::copy(writer.frame()), frame);
}

TEST(Bytes, NothingBeyondTheEnd) {
  std::uint8_t room[6] = {1, 2, 3, 4, 5, 6};
  servo::Reader in({room, 5});
  EXPECT_EQ(in.u16(), 0x0201);
  EXPECT_EQ(in.rest().count, 3U);
  EXPECT_EQ(in.u32(), 0U);
  EXPECT_FALSE(in.good());
  EXPECT_EQ(in.u8(), 0);  // not even what would be there

  servo::Writer out(room, 5);
  out.u32(0x0A0B0C0DU);
  EXPECT_TRUE(out.good());
  out.u16(0xFFFF);
  out.u8(0xFF);
  EXPECT_FALSE(out.good());
  EXPECT_EQ(out.count(), 4U);
  EXPECT_EQ(Packet(room, room + 6), (Packet{0x0D, 0x0C, 0x0B, 0x0A, 5, 6}));
}

}  // namespace
