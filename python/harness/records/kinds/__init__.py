# SPDX-License-Identifier: MIT
"""Kinds of files, one a module: how its content is read, and `KIND`, by which `formats` finds it.

A module is imported before its kind is needed; it imports its library only where it reads a file.
"""
