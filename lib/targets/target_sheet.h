#pragma once

#include <string>

#include "lib/result/result.h"
#include "lib/targets/sheet_layout.h"
#include "lib/targets/target_library.h"

namespace imprint {

/// The planned pages as a vector PDF, true to scale when printed at 100 %: dots and rings white on black, each target
/// with its id; on paper crop marks outside the corners of each black square; on each page two scale bars, since
/// printers scale, and not always the same along and across the paper. Bit 0 of a code begins at the right of its dot.
/// Fails only when cairo does.
Result<std::string> draw_target_sheet(const TargetLibrary& library, const SheetLayout& layout, const SheetPlan& plan);

}  // namespace imprint
