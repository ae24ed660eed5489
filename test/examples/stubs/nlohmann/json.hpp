// Copyright 2026 The hooc_perception authors
// SPDX-License-Identifier: Apache-2.0
//
// As much of nlohmann::json as the example uses, for machines without it.

#pragma once

#include <cctype>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace nlohmann
{

class json
{
public:
  struct Item
  {
    const std::string & key() const {return key_;}
    const json & value() const {return *value_;}
    std::string key_;
    const json * value_;
  };

  static json parse(const std::string & text)
  {
    size_t at = 0;
    return value(text, at);
  }

  const json & at(const std::string & key) const
  {
    for (const auto & member : members_) {
      if (member.first == key) {return member.second;}
    }
    throw std::out_of_range(key);
  }

  std::vector<Item> items() const
  {
    std::vector<Item> out;
    for (const auto & member : members_) {out.push_back({member.first, &member.second});}
    return out;
  }

  template<class T>
  T get() const {return text_;}

private:
  static char next(const std::string & text, size_t & at)
  {
    while (std::isspace(static_cast<unsigned char>(text.at(at)))) {++at;}
    return text.at(at);
  }

  static std::string quoted(const std::string & text, size_t & at)
  {
    std::string out;
    for (++at; text.at(at) != '"'; ++at) {
      if (text[at] == '\\') {++at;}
      out += text.at(at);
    }
    ++at;
    return out;
  }

  static json value(const std::string & text, size_t & at)
  {
    json out;
    const char kind = next(text, at);
    if (kind == '"') {
      out.text_ = quoted(text, at);
    } else if (kind == '{' || kind == '[') {
      const char end = kind == '{' ? '}' : ']';
      for (++at; next(text, at) != end; ) {
        std::string key;
        if (kind == '{') {
          key = quoted(text, at);
          next(text, at);
          ++at;   // the colon
        }
        out.members_.emplace_back(key, value(text, at));
        if (next(text, at) == ',') {++at; next(text, at);}
      }
      ++at;
    } else {
      while (at < text.size() && std::string(",]} \n").find(text[at]) == std::string::npos) {
        out.text_ += text[at++];
      }
    }
    return out;
  }

  std::string text_;
  std::vector<std::pair<std::string, json>> members_;
};

}  // namespace nlohmann
