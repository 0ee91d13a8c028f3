// SPDX-License-Identifier: MIT
// expected: fields() of this struct leaves out a member
#include <ehsid/ehsid.hpp>

struct State {
  float weight;
  float mean;

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&State::weight);
#ifdef CORRECTED
    visit(&State::mean);
#endif
  }
};

void save(ehsid::ByteStream& stream, const State& state) {
  ehsid::stream_fields(stream, ehsid::ModelShape{}, state);
}
