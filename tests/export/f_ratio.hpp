// Written by `ehsid export`, ehsid 0.2.0; do not edit, export again.
// Settings and start of the online estimator, and a self-test for the target. Numbers are float32 in
// hexadecimal, exact to the bit; decimals are for people.
//
// Record hydraulic_crane.csv, sha256
// 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
// Made by tests/export/make_headers.py
//
// Results are bit for bit those of Python where the compiler does not fuse multiplications and additions
// (-ffp-contract=off, as the CMake target ehsid::reproducible sets it), nor uses -ffast-math.
// clang-format off
#pragma once

#include <cstdint>
#include <cstring>
#include <ehsid/ehsid.hpp>

namespace f_ratio {

/// na = 2, nb = 3, nk = 2, constant term.
using Estimator =
    ehsid::ArxEstimator<float, 2, 3, 2, ehsid::FRatio<float>, true>;

/// Sampling time of the record, s; the parameters hold for no other.
inline constexpr float kDtS = 0x1.99999ap-5F;  // 0.05

/// theta_0, in the units of the signals about the offsets of the scaling.
inline constexpr ehsid::Array<float, Estimator::kN> kTheta0 = {{
    -0x1.c872bp+0F,  // a1 = -1.783
    0x1.aa161ep-1F,  // a2 = 0.8322
    0x1.46c226p-2F,  // b1 = 0.3191
    -0x1.8b020cp+0F,  // b2 = -1.543
    0x1.256042p+0F,  // b3 = 1.146
    0x1.13c686p-14F,  // offset = 6.575e-05
}};

/// P_0 = U D U' of the scaled parameters in units of sigma^2: D, then the columns of U above its diagonal.
inline constexpr ehsid::UdFactors<float, Estimator::kN> kFactors0 = {
    {{
        0x1.4794eap-7F,  // 0.009997
        0x1.fced92p-2F,  // 0.497
        0x1.c8755p-6F,  // 0.02786
        0x1.427efap+2F,  // 5.039
        0x1.440a3ep+6F,  // 81.01
        0x1.4801f8p-7F,  // 0.01001
    }},
    {{
        -0x1.f9e83ep-1F,  // -0.9881
        -0x1.94af5p-2F,  // -0.3952
        -0x1.a1b08ap-2F,  // -0.4079
        0x1.892cdp-4F,  // 0.09599
        -0x1.81c2e4p-4F,  // -0.09418
        -0x1.ffbe76p-1F,  // -0.9995
        0x1.3ffac2p-6F,  // 0.01953
        -0x1.2ccf6cp-6F,  // -0.01836
        0x1.e68db8p-1F,  // 0.9503
        -0x1.f2f1aap+0F,  // -1.949
        -0x1.400fbap-5F,  // -0.03907
        0x1.4eb9a2p-5F,  // 0.04086
        -0x1.063f14p-2F,  // -0.2561
        0x1.73fb7ap-9F,  // 0.002838
        0x1.0710ccp-2F,  // 0.2569
    }},
};

/// sigma^2 of the offline model, squared units of the position.
inline constexpr float kNoiseVariance = 0x1.672324p-7F;  // 0.01096

/// Sets the estimator up and starts it from the offline model; ok, unless this file was changed.
inline ehsid::Status configure(Estimator& estimator) {
  Estimator::Options options;
  options.scaling.command_scale = 0x1.60d1b8p-1F;  // 0.6891
  options.scaling.position_scale = 0x1.845a1cp+0F;  // 1.517
  options.scaling.command_offset = -0x1.875f7p-3F;  // -0.1911
  options.scaling.position_offset = 0x1.7b634ep-8F;  // 0.005789
  options.forgetting.eta = 0x1.8p+0F;  // 1.5
  options.forgetting.critical_ratio = 0x1.8p+1F;  // 3
  options.rls.information_margin = 0x1.8p+0F;  // 1.5
  options.rls.covariance_ceiling = 0x1p+1F;  // 2
  options.reset.short_window = 0x1.4p+2F;  // 5
  options.reset.long_window = 0x1.ep+5F;  // 60
  options.reset.trigger_ratio = 0x1p+1F;  // 2
  options.reset.release_ratio = 0x1.8p+0F;  // 1.5
  options.reset.cool_down = 50;
  options.reset.floor = 0x1.4f8b58p-17F;  // 1e-05
  options.convergence.tolerance = 0x1.99999ap-4F;  // 0.1
  options.convergence.magnitude = 0x1.99999ap-4F;  // 0.1
  options.convergence.hold = 10;
  options.variance0 = Estimator::Parameters::Constant(Estimator::kN, 0x1.e848p+19F);  // 1e+06
  options.input_limit = 0x1.f4p+9F;  // 1000
  const ehsid::Status status = estimator.configure(options);
  if (status != ehsid::Status::ok) {
    return status;
  }
  return estimator.seed(ehsid::to_vector<Estimator::kN>(Estimator::kN, kTheta0), kFactors0, kNoiseVariance);
}

/// A sample of the golden trace: command and position in their units, and the innovation after it.
struct TraceSample {
  float command;
  float position;
  float innovation;
};

inline constexpr ehsid::Array<TraceSample, 64> kTrace = {{
    {-0x1.a27d68p-1F, 0x1.cc72c4p+0F, 0x0p+0F},
    {-0x1.e0fd7ep-1F, 0x1.1a8cf2p+1F, 0x0p+0F},
    {-0x1.0c9eecp+0F, 0x1.2d7688p+1F, 0x0p+0F},
    {-0x1.245eb4p+0F, 0x1.372c68p+1F, 0x0p+0F},
    {-0x1.321ea4p+0F, 0x1.3932aep+1F, -0x1.7583bcp-4F},
    {-0x1.3c1e7ap+0F, 0x1.2cd974p+1F, -0x1.1be6e6p-3F},
    {-0x1.411e64p+0F, 0x1.147c46p+1F, -0x1.ec4222p-4F},
    {-0x1.475ec8p+0F, 0x1.ed5158p+0F, -0x1.f2128p-5F},
    {-0x1.4a7efap+0F, 0x1.aac9d6p+0F, -0x1.a34dc8p-5F},
    {-0x1.4b1ee2p+0F, 0x1.5e4276p+0F, -0x1.584d1cp-4F},
    {-0x1.4b1ee2p+0F, 0x1.3ebb08p+0F, 0x1.ece8dp-4F},
    {-0x1.4b1ee2p+0F, 0x1.01d402p+0F, -0x1.3ad39ap-3F},
    {-0x1.4a7efap+0F, 0x1.844a8p-1F, -0x1.22dfd6p-4F},
    {-0x1.4a7efap+0F, 0x1.1015eep-1F, -0x1.9248f4p-5F},
    {-0x1.439eaep+0F, 0x1.7893b2p-2F, -0x1.89f592p-7F},
    {-0x1.38fefp+0F, 0x1.06c95ap-2F, -0x1.724bdp-6F},
    {-0x1.2efe72p+0F, 0x1.a9646ep-3F, 0x1.fb645cp-9F},
    {-0x1.1f5ec8p+0F, 0x1.8dcc78p-3F, -0x1.e5d158p-8F},
    {-0x1.05beap+0F, 0x1.e29d2p-3F, 0x1.2f09acp-6F},
    {-0x1.c7fd6p-1F, 0x1.4c6c2ep-2F, 0x1.14775ap-5F},
    {-0x1.7bbd7cp-1F, 0x1.d0d458p-2F, 0x1.d45d36p-5F},
    {-0x1.2f7d74p-1F, 0x1.2d1f32p-1F, 0x1.7c121ap-5F},
    {-0x1.c3faf4p-2F, 0x1.80390ap-1F, 0x1.719c08p-4F},
    {-0x1.32fad6p-2F, 0x1.dd5418p-1F, 0x1.89dd64p-4F},
    {-0x1.52f5dcp-3F, 0x1.291172p+0F, 0x1.0c19eap-3F},
    {-0x1.63d70ap-5F, 0x1.0c9e34p+0F, -0x1.f7348ep-3F},
    {0x1.4c1476p-4F, 0x1.c9f9f6p-1F, 0x1.5361ap-5F},
    {0x1.910a14p-3F, 0x1.f1c8c8p-2F, -0x1.6ce94ep-3F},
    {0x1.39053ap-2F, -0x1.6a0228p-7F, -0x1.92d1dap-5F},
    {0x1.9d052ap-2F, -0x1.37840cp-3F, 0x1.81dd7cp-2F},
    {0x1.f98528p-2F, -0x1.b9baf2p-2F, -0x1.a017f2p-4F},
    {0x1.24c294p-1F, -0x1.ae1ab8p-1F, -0x1.d6dd6ep-4F},
    {0x1.468294p-1F, -0x1.357d72p+0F, 0x1.7a176cp-6F},
    {0x1.65c29p-1F, -0x1.bf34bap+0F, -0x1.8fad92p-3F},
    {0x1.7b0292p-1F, -0x1.2180ep+1F, -0x1.5d395cp-5F},
    {0x1.8c829cp-1F, -0x1.451c16p+1F, 0x1.30c856p-3F},
    {0x1.9a428ep-1F, -0x1.95a2e2p+1F, -0x1.af08d2p-2F},
    {0x1.a30292p-1F, -0x1.b2618cp+1F, 0x1.0f92c8p-2F},
    {0x1.abc298p-1F, -0x1.ca4b4ep+1F, -0x1.281914p-4F},
    {0x1.b5c29p-1F, -0x1.e74358p+1F, -0x1.2ff5f2p-3F},
    {0x1.c3828p-1F, -0x1.f41346p+1F, -0x1.78801cp-9F},
    {0x1.d14292p-1F, -0x1.fb700ap+1F, -0x1.289b8ap-4F},
    {0x1.e04296p-1F, -0x1.f978f4p+1F, -0x1.237dfcp-5F},
    {0x1.ef429ap-1F, -0x1.e7ff6cp+1F, 0x1.34c102p-5F},
    {0x1.ff829p-1F, -0x1.e0af2ep+1F, -0x1.1eb532p-3F},
    {0x1.08811cp+0F, -0x1.cc0acp+1F, 0x1.7873fap-5F},
    {0x1.11e108p+0F, -0x1.b38b4cp+1F, -0x1.9ac05ep-8F},
    {0x1.1dc14p+0F, -0x1.8fb27ap+1F, 0x1.1ae718p-4F},
    {0x1.27212ep+0F, -0x1.7e266p+1F, -0x1.16351p-3F},
    {0x1.312104p+0F, -0x1.627f62p+1F, 0x1.2cb306p-4F},
    {0x1.3c6152p+0F, -0x1.53312p+1F, -0x1.ea26a6p-5F},
    {0x1.42a10ep+0F, -0x1.425202p+1F, 0x1.d89706p-6F},
    {0x1.47a0fap+0F, -0x1.37f9c6p+1F, -0x1.a9a25p-6F},
    {0x1.48e172p+0F, -0x1.2713a2p+1F, 0x1.91ffc2p-4F},
    {0x1.48e172p+0F, -0x1.216002p+1F, -0x1.8bb75cp-5F},
    {0x1.48e172p+0F, -0x1.22fa5cp+1F, -0x1.6992cap-6F},
    {0x1.48418ap+0F, -0x1.29252cp+1F, -0x1.754558p-6F},
    {0x1.466128p+0F, -0x1.32c0e4p+1F, -0x1.b977bep-6F},
    {0x1.44817p+0F, -0x1.3de15ap+1F, -0x1.15ac58p-6F},
    {0x1.4340f6p+0F, -0x1.4876d6p+1F, -0x1.69c7e2p-8F},
    {0x1.40c154p+0F, -0x1.56628ep+1F, -0x1.6f011ep-5F},
    {0x1.3e410cp+0F, -0x1.6381f6p+1F, -0x1.6fb8acp-6F},
    {0x1.3bc16ap+0F, -0x1.7293b4p+1F, -0x1.50218cp-5F},
    {0x1.3a8198p+0F, -0x1.7fc576p+1F, -0x1.872f3cp-6F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.cb93aep+0F,  // -1.79522
    0x1.ae3dap-1F,  // 0.840314
    0x1.613c2ap-1F,  // 0.689912
    -0x1.d97c0ep+0F,  // -1.84955
    0x1.167278p+0F,  // 1.08768
    -0x1.80cb64p-7F,  // -0.011743
}};

inline bool same_bits(float left, float right) {
  std::uint32_t left_bits = 0;
  std::uint32_t right_bits = 0;
  std::memcpy(&left_bits, &left, sizeof left);
  std::memcpy(&right_bits, &right, sizeof right);
  return left_bits == right_bits;
}

/// Runs the trace through an estimator of its own, sizeof(Estimator) bytes on the stack. True where every
/// innovation and the last theta_hat are, bit for bit, those that Python computed.
inline bool self_test() {
  Estimator estimator;
  bool same = configure(estimator) == ehsid::Status::ok;
  for (const TraceSample& sample : kTrace) {
    same = !ehsid::is_error(estimator.step(sample.command, sample.position)) &&
           same_bits(estimator.innovation(), sample.innovation) && same;
  }
  const Estimator::Parameters theta = estimator.theta_hat();
  for (int i = 0; i < Estimator::kN; ++i) {
    same = same_bits(theta[i], ehsid::entry(kTraceTheta, i)) && same;
  }
  return same;
}

}  // namespace f_ratio
