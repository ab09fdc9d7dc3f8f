#ifndef RCLCPP_LOGGING_HPP
#define RCLCPP_LOGGING_HPP
#include <cstdio>
namespace rclcpp
{
class Logger
{
};
}  // namespace rclcpp
#define RCLCPP_ERROR(logger, ...) (static_cast<void>(logger), static_cast<void>(std::printf(__VA_ARGS__)), static_cast<void>(std::printf("\n")))
#endif
