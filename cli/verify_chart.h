#pragma once

#include <string>
#include <vector>

#include "survey/verify_history.h"

namespace imprint {

/// Control charts of a history, one for each thing checked: deviations in their order with their 95 % intervals, and
/// dashed the limits they were held against; the last verification that failed is marked.
/// `as_page`: an HTML document with a chart and its figures for each; else one SVG picture of all, one below the other.
std::string draw_history(const std::vector<HistoryRow>& rows, bool as_page);

}  // namespace imprint
