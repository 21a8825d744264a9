#pragma once

#include "model/model.hpp"

namespace redysim {

// Why a model has no model exchange, as a sentence; null: it has.
inline const char* objection_to_model_exchange(const Model& model) {
  for (const Contact& contact : model.contacts)
    if (contact.law == Contact::Law::redysim)
      return "no model exchange: the force of contacts with law = \"redysim\" jumps where they begin";
  return nullptr;
}

}  // namespace redysim
