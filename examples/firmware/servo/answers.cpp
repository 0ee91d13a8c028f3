// SPDX-License-Identifier: MIT
#include "answers.hpp"

#include <ehsid/version.hpp>

#include "kernels.hpp"

namespace servo {

namespace {

std::uint16_t up_to_u16(std::int32_t count) {
  return static_cast<std::uint16_t>(count < 0xFFFF ? count : 0xFFFF);
}

}  // namespace

void write_identity(Writer& out, const char* board) {
  out.u16(kProtocolVersion);
  out.u8(EHSID_VERSION_MAJOR);
  out.u8(EHSID_VERSION_MINOR);
  out.u8(EHSID_VERSION_PATCH);
  out.u8(kPolicies);
  out.u16(kParameterCounts);
  for (std::size_t i = 0; i < kBoardBytes; ++i) {
    out.u8(static_cast<std::uint8_t>(*board));
    if (*board != '\0') {
      ++board;
    }
  }
}

void write_result(Writer& out, std::uint32_t number, const Result& result, const Counts& counts) {
  const ehsid_report& report = result.report;
  out.u32(number);
  out.f32(result.command.volts);
  out.f32(result.gain_v_m);
  out.f32(result.velocity_gain_m_s_v);
  out.u8(static_cast<std::uint8_t>(result.status));
  out.u8(static_cast<std::uint8_t>(
      (report.converged ? kConverged : 0) | (result.gain_from_estimate ? kGainFromEstimate : 0) |
      (result.command.at_limit ? kAtLimit : 0) | (report.white ? 0 : kResidualsNotWhite)));
  out.u16(up_to_u16(report.resets));
  out.f32(report.innovation);
  out.f32(report.forgetting_factor);
  out.f32(report.fit_percent);
  out.f32(report.excitation);
  out.f32(report.residual_variance);
  out.u32(counts.step_cycles);
  out.u16(counts.bad_frames);
  out.u16(counts.repeated);
  out.u16(counts.trips);
  out.u8(static_cast<std::uint8_t>(result.parameters));
  for (std::size_t i = 0; i < result.parameters; ++i) {
    out.f32(result.theta[i]);
  }
}

void write_servo_result(Writer& out, std::uint32_t number, const Result& result,
                        const Counts& counts) {
  const ehsid_tracked_servo& servo = result.servo;
  out.u32(number);
  out.f32(result.command.volts);
  out.f32(result.gain_v_m);
  out.u8(static_cast<std::uint8_t>(result.status));
  out.u8(static_cast<std::uint8_t>((result.gain_from_estimate ? kGainFromEstimate : 0) |
                                   (result.command.at_limit ? kAtLimit : 0)));
  for (const ehsid_tracked_value* value : {&servo.gain, &servo.omega_n, &servo.xi}) {
    out.f32(value->value);
    out.f32(value->half_width);
    out.u8(static_cast<std::uint8_t>(value->reason));
  }
  out.u32(counts.step_cycles);
  out.u16(counts.bad_frames);
  out.u16(counts.repeated);
  out.u16(counts.trips);
}

}  // namespace servo
