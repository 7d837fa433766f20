#include <catch2/catch.hpp>

#include "lib/transport/key_expression.h"

using imprint::check_key;
using imprint::keys_intersect;

TEST_CASE("key expression: * is one chunk, ** any number") {
  CHECK(keys_intersect("a/b", "a/b"));
  CHECK_FALSE(keys_intersect("a/b", "a/c"));
  CHECK_FALSE(keys_intersect("a/b", "a"));
  CHECK(keys_intersect("a/*", "a/b"));
  CHECK_FALSE(keys_intersect("a/*", "a"));
  CHECK_FALSE(keys_intersect("a/*", "a/b/c"));
  CHECK(keys_intersect("a/**", "a"));
  CHECK(keys_intersect("a/**", "a/b/c"));
  CHECK(keys_intersect("**/c", "a/b/c"));
  CHECK_FALSE(keys_intersect("**/c", "a/b/d"));
  CHECK(keys_intersect("a/**/d", "a/d"));
  CHECK(keys_intersect("a/**/d", "a/b/c/d"));
  CHECK_FALSE(keys_intersect("a/**/d", "b/d"));
  CHECK(keys_intersect("**", "a/b/c"));
}

TEST_CASE("key expression: two expressions intersect when some key is in both") {
  CHECK(keys_intersect("a/*/c", "a/b/*"));
  CHECK(keys_intersect("a/**", "**/z"));
  CHECK(keys_intersect("a/**/x/**", "**/x/b"));
  CHECK_FALSE(keys_intersect("a/*", "b/**"));
  CHECK_FALSE(keys_intersect("a/*/c", "a/*/d"));
}

TEST_CASE("key expression: wildcards leave chunks with @ alone") {
  CHECK_FALSE(keys_intersect("a/*", "a/@adv"));
  CHECK_FALSE(keys_intersect("a/**", "a/@adv/b"));
  CHECK(keys_intersect("a/@adv/*", "a/@adv/b"));
}

TEST_CASE("key expression: the check names the key and the chunk") {
  CHECK(check_key("a/b-c_d.e/@x", false));
  CHECK(check_key("a/*/**", true));
  CHECK_FALSE(check_key("a/*", false));
  for (const char* key : {"", "/a", "a/", "a//b", "a#", "a?b", "$*", "a/b*", "**/**", "**/*"}) {
    INFO(key);
    CHECK_FALSE(check_key(key, true));
  }
}
