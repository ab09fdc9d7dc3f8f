#ifndef PLUGINLIB_CLASS_LIST_MACROS_HPP
#define PLUGINLIB_CLASS_LIST_MACROS_HPP
#include <type_traits>
#define PLUGINLIB_EXPORT_CLASS(Own, Base) static_assert(std::is_base_of<Base, Own>::value && !std::is_abstract<Own>::value, "");
#endif
