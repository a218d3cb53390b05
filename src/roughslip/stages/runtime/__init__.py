"""What every stage command shares: arguments, records of cost, reasons for skipped work."""
