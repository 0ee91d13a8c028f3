// SPDX-License-Identifier: MIT
// Everything a controller needs; never the plant.
#pragma once

#include <ehsid/arx.hpp>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/fit.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/growth_monitor.hpp>
#include <ehsid/instrumental_variables.hpp>
#include <ehsid/monitor.hpp>
#include <ehsid/reset.hpp>
#include <ehsid/rls.hpp>
#include <ehsid/scaling.hpp>
#include <ehsid/servo_bank.hpp>
#include <ehsid/servo_estimator.hpp>
#ifndef EHSID_WITHOUT_EIGEN
#include <ehsid/servo_model.hpp>
#endif
#include <ehsid/types.hpp>
#include <ehsid/ud.hpp>
#include <ehsid/version.hpp>
#include <ehsid/whiteness.hpp>
