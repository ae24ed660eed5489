// Copyright 2026 The hooc_perception authors
// SPDX-License-Identifier: Apache-2.0
//
// Print the objects of every result. Needs rclcpp, sensor_msgs, std_msgs and nlohmann-json3-dev,
// and nothing of this package.

#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <sensor_msgs/point_cloud2_iterator.hpp>
#include <std_msgs/msg/string.hpp>

struct Object
{
  uint32_t id;
  uint16_t category;
  float score, x, y, z;
};

// Row i of objects/attributes is the object of pose i in objects/poses.
std::vector<Object> objects_of(const sensor_msgs::msg::PointCloud2 & cloud)
{
  using Floats = sensor_msgs::PointCloud2ConstIterator<float>;
  Floats x(cloud, "x"), y(cloud, "y"), z(cloud, "z"), score(cloud, "score");
  sensor_msgs::PointCloud2ConstIterator<uint32_t> id(cloud, "id");
  sensor_msgs::PointCloud2ConstIterator<uint16_t> category(cloud, "category");
  std::vector<Object> objects;
  for (uint32_t i = 0; i < cloud.width; ++i, ++x, ++y, ++z, ++score, ++id, ++category) {
    objects.push_back({*id, *category, *score, *x, *y, *z});
  }
  return objects;
}

// The names of the class ids, from objects/labels.
std::map<uint16_t, std::string> names_of(const std::string & labels)
{
  std::map<uint16_t, std::string> names;
  const auto json = nlohmann::json::parse(labels);
  for (const auto & entry : json.at("classes").items()) {
    names[static_cast<uint16_t>(std::stoi(entry.key()))] =
      entry.value().at("name").get<std::string>();
  }
  return names;
}

class ListObjects : public rclcpp::Node
{
public:
  ListObjects()
  : Node("list_objects", "/hooc")
  {
    // Latched: a late subscriber gets the last result at once.
    const auto latched = rclcpp::QoS(1).reliable().transient_local();
    labels_ = create_subscription<std_msgs::msg::String>(
      "objects/labels", latched,
      [this](const std_msgs::msg::String & message) {names_ = names_of(message.data);});
    attributes_ = create_subscription<sensor_msgs::msg::PointCloud2>(
      "objects/attributes", latched,
      [this](const sensor_msgs::msg::PointCloud2 & cloud) {
        for (const Object & o : objects_of(cloud)) {
          std::printf(
            "%u %s %.2f at %.3f %.3f %.3f in %s\n", o.id, names_[o.category].c_str(), o.score,
            o.x, o.y, o.z, cloud.header.frame_id.c_str());
        }
      });
  }

private:
  std::map<uint16_t, std::string> names_;
  rclcpp::Subscription<std_msgs::msg::String>::SharedPtr labels_;
  rclcpp::Subscription<sensor_msgs::msg::PointCloud2>::SharedPtr attributes_;
};

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<ListObjects>());
  rclcpp::shutdown();
}
