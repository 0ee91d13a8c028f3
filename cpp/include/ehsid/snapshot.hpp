// SPDX-License-Identifier: MIT
// A saved state: a header that says of what it is, the state, and a checksum over all of it. docs/linking.md has the
// layout as a table.
#pragma once

#include <ehsid/fields.hpp>

namespace ehsid {

/// Why a snapshot is not taken over.
enum class SnapshotFault : std::uint8_t {
  none = 0,
  not_a_snapshot = 1,       // does not begin as a saved state of this kind does
  other_version = 2,        // of another version of the layout, see kSnapshotVersion
  damaged = 3,              // length or checksum is wrong
  other_model = 4,          // other orders, delay, constant term, precision or forgetting policy
  other_configuration = 5,  // the same model with another setting
  impossible = 6,           // the checksum is right, but no estimator has such a state
};

/// The name of the fault, as of a Status.
constexpr const char* to_string(SnapshotFault fault) {
  switch (fault) {
    case SnapshotFault::none:
      return "none";
    case SnapshotFault::not_a_snapshot:
      return "not_a_snapshot";
    case SnapshotFault::other_version:
      return "other_version";
    case SnapshotFault::damaged:
      return "damaged";
    case SnapshotFault::other_model:
      return "other_model";
    case SnapshotFault::other_configuration:
      return "other_configuration";
    case SnapshotFault::impossible:
      return "impossible";
  }
  return "unknown";
}

/// Version of the layout. Any change of what is saved, or of the order, needs a new one.
inline constexpr std::uint16_t kSnapshotVersion = 4;

/// What stands in front of the state.
struct SnapshotHeader {
  std::uint32_t magic;  // of what kind: an OnlineEstimator, or an Rls
  std::uint16_t
      version;  // kSnapshotVersion. Magic and version stand in these six bytes in every version.
  std::uint16_t scalar_bytes;  // 4 or 8
  std::uint16_t policy;        // kId of the forgetting policy
  ModelShape shape;
  std::uint32_t bytes;          // of the whole snapshot, with header and checksum
  std::uint32_t configuration;  // checksum of the settings

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&SnapshotHeader::magic);
    visit(&SnapshotHeader::version);
    visit(&SnapshotHeader::scalar_bytes);
    visit(&SnapshotHeader::policy);
    visit(&SnapshotHeader::shape);
    visit(&SnapshotHeader::bytes);
    visit(&SnapshotHeader::configuration);
  }
};

/// Bytes of the checksum behind the state.
inline constexpr std::size_t kChecksumBytes = sizeof(std::uint32_t);

/// Bytes of a snapshot whose state is the struct `Contents`.
template <class Contents>
constexpr std::size_t snapshot_bytes(const ModelShape& of) {
  return field_bytes<SnapshotHeader>(of) + field_bytes<Contents>(of) + kChecksumBytes;
}

/// The header in front of such a state. configuration: checksum of the settings.
template <class Scalar, class Forgetting, class Contents>
SnapshotHeader make_header(std::uint32_t magic, const ModelShape& shape,
                           std::uint32_t configuration) {
  return {magic,
          kSnapshotVersion,
          static_cast<std::uint16_t>(sizeof(Scalar)),
          static_cast<std::uint16_t>(Forgetting::kId),
          shape,
          static_cast<std::uint32_t>(snapshot_bytes<Contents>(shape)),
          configuration};
}

/// Writes header.bytes bytes: header, contents, and the CRC-32 of both. Neither argument is const, though nothing changes
/// them: so the code that writes them is also that which reads them.
template <class Contents>
void write_snapshot(std::uint8_t* to, SnapshotHeader header, Contents& contents) {
  ByteStream writer = ByteStream::writing(to);
  stream_fields(writer, header.shape, header);
  stream_fields(writer, header.shape, contents);
  const std::uint32_t checksum = writer.checksum();
  writer.values(&checksum, 1);
}

/// Are the `count` bytes an undamaged snapshot of what `own` describes? Says nothing about the state in it.
inline SnapshotFault check_snapshot(const std::uint8_t* bytes, std::size_t count,
                                    const SnapshotHeader& own) {
  constexpr std::size_t kLeast = field_bytes<SnapshotHeader>(ModelShape{}) + kChecksumBytes;
  constexpr std::size_t kToVersion = sizeof own.magic + sizeof own.version;
  SnapshotHeader found = own;
  ByteStream reader = ByteStream::reading(bytes);
  if (count >= kToVersion) {
    reader.values(&found.magic, 1);
    reader.values(&found.version, 1);
  }
  if (count < kToVersion || found.magic != own.magic) {
    return SnapshotFault::not_a_snapshot;
  }
  if (found.version != own.version) {
    return SnapshotFault::other_version;
  }
  if (count < kLeast) {
    return SnapshotFault::damaged;
  }
  reader = ByteStream::reading(bytes);
  stream_fields(reader, own.shape, found);
  Crc32 crc;
  for (std::size_t i = 0; i < count - kChecksumBytes; ++i) {
    crc.add(bytes[i]);
  }
  std::uint32_t checksum = 0;
  reader = ByteStream::reading(bytes + (count - kChecksumBytes));
  reader.values(&checksum, 1);
  if (found.bytes != count || checksum != crc.value()) {
    return SnapshotFault::damaged;
  }
  if (found.scalar_bytes != own.scalar_bytes || found.policy != own.policy ||
      !(found.shape == own.shape)) {
    return SnapshotFault::other_model;
  }
  return found.configuration == own.configuration && found.bytes == own.bytes
             ? SnapshotFault::none
             : SnapshotFault::other_configuration;
}

/// Reads the contents that write_snapshot() wrote, unless check_snapshot() finds a fault. Whether the state is a possible
/// one is for the caller to decide.
template <class Contents>
SnapshotFault read_snapshot(const std::uint8_t* bytes, std::size_t count, const SnapshotHeader& own,
                            Contents& contents) {
  const SnapshotFault fault = check_snapshot(bytes, count, own);
  if (fault == SnapshotFault::none) {
    ByteStream reader = ByteStream::reading(bytes + field_bytes<SnapshotHeader>(own.shape));
    stream_fields(reader, own.shape, contents);
  }
  return fault;
}

}  // namespace ehsid
