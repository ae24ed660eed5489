// Copyright 2026 The hooc_perception authors
// SPDX-License-Identifier: Apache-2.0
//
// As much of rclcpp as the example uses; spin() hands over the files that the test has written.

#pragma once

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>

#include <sensor_msgs/msg/point_cloud2.hpp>
#include <std_msgs/msg/string.hpp>

namespace rclcpp
{

struct QoS
{
  explicit QoS(int depth) : depth(depth) {}
  QoS & reliable() {is_reliable = true; return *this;}
  QoS & transient_local() {is_latched = true; return *this;}
  int depth;
  bool is_reliable = false, is_latched = false;
};

template<class Message>
struct Subscription
{
  using SharedPtr = std::shared_ptr<Subscription>;
  std::function<void(const Message &)> callback;
};

inline std::function<void(const std_msgs::msg::String &)> on_labels;
inline std::function<void(const sensor_msgs::msg::PointCloud2 &)> on_cloud;

class Node
{
public:
  Node(const std::string &, const std::string & name_space)
  {
    if (name_space != "/hooc") {std::exit(2);}
  }

  template<class Message, class Callback>
  std::shared_ptr<Subscription<Message>> create_subscription(
    const std::string & topic, const QoS & qos, Callback callback)
  {
    if (!qos.is_reliable || !qos.is_latched || qos.depth != 1) {std::exit(3);}
    if constexpr (std::is_same_v<Message, std_msgs::msg::String>) {
      if (topic != "objects/labels") {std::exit(4);}
      on_labels = callback;
    } else {
      if (topic != "objects/attributes") {std::exit(5);}
      on_cloud = callback;
    }
    return std::make_shared<Subscription<Message>>();
  }
};

inline std::string file(const char * variable)
{
  std::ifstream stream(std::getenv(variable), std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void init(int, char **) {}
inline void shutdown() {}

inline void spin(std::shared_ptr<Node>)
{
  std_msgs::msg::String labels;
  labels.data = file("LABELS");
  on_labels(labels);
  sensor_msgs::msg::PointCloud2 cloud;
  std::ifstream head(std::getenv("HEAD"));
  head >> cloud.header.frame_id >> cloud.width >> cloud.point_step;
  for (sensor_msgs::msg::PointField field; head >> field.name >> field.offset; ) {
    int datatype;
    head >> datatype;
    field.datatype = static_cast<uint8_t>(datatype);
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.height = 1;
  const std::string data = file("DATA");
  cloud.data.assign(data.begin(), data.end());
  on_cloud(cloud);
}

}  // namespace rclcpp
