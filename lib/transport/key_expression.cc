#include "lib/transport/key_expression.h"

namespace imprint {
namespace {

struct Split {
  std::string_view chunk;
  std::string_view rest;
  bool last;
};

Split split_first(std::string_view key) {
  const auto slash = key.find('/');
  if (slash == std::string_view::npos) return {key, {}, true};
  return {key.substr(0, slash), key.substr(slash + 1), false};
}

bool chunks_match(std::string_view a, std::string_view b) {
  if (a == b) return true;
  if (a == "*") return !b.starts_with('@');
  return b == "*" && !a.starts_with('@');
}

// An expression's remaining chunks; `done` tells the end from an empty chunk.
struct Rest {
  std::string_view text;
  bool done;
};

Rest after(const Split& split) { return {split.rest, split.last}; }

bool only_any(Rest rest) { return rest.done || rest.text == "**"; }

bool intersect(Rest a, Rest b) {
  if (a.done) return only_any(b);
  if (b.done) return only_any(a);
  const Split first_a = split_first(a.text);
  const Split first_b = split_first(b.text);
  if (first_a.chunk == "**")
    return intersect(after(first_a), b) || (!first_b.chunk.starts_with('@') && intersect(a, after(first_b)));
  if (first_b.chunk == "**")
    return intersect(a, after(first_b)) || (!first_a.chunk.starts_with('@') && intersect(after(first_a), b));
  return chunks_match(first_a.chunk, first_b.chunk) && intersect(after(first_a), after(first_b));
}

}  // namespace

Result<void> check_key(std::string_view key, bool wildcards) {
  std::string_view previous;
  for (Rest rest{key, false}; !rest.done;) {
    const Split split = split_first(rest.text);
    if (split.chunk.empty())
      return invalid_input("key '{}': expected chunks divided by single '/', found an empty one", key);
    const bool wild = split.chunk == "*" || split.chunk == "**";
    if (!wild && split.chunk.find_first_of("*#?$") != std::string_view::npos)
      return invalid_input("key '{}': expected chunks without '*', '#', '?', '$', found '{}'", key, split.chunk);
    if (wild && !wildcards)
      return invalid_input("key '{}': expected a key without wildcards, found '{}'", key, split.chunk);
    if (wild && previous == "**")
      return invalid_input("key '{}': expected '*' before '**' and '**' once, found '**/{}'", key, split.chunk);
    previous = split.chunk;
    rest = after(split);
  }
  return {};
}

bool keys_intersect(std::string_view a, std::string_view b) { return intersect({a, false}, {b, false}); }

}  // namespace imprint
